#include "protocol/number.h"
#include <stdio.h>
#include <stdlib.h>

void pen_print_double(double value, char *text)
{
    for (int digits = 15; digits <= 17; digits++) {
        snprintf(text, 32, "%.*g", digits, value);
        if (strtod(text, NULL) == value)
            return;
    }
}

void pen_print_float(float value, char *text)
{
    for (int digits = 6; digits <= 9; digits++) {
        snprintf(text, 32, "%.*g", digits, (double)value);
        /* Readers go through a double, so that is what has to come back. */
        if ((float)strtod(text, NULL) == value)
            return;
    }
}

double pen_widen(float value)
{
    char text[32];
    pen_print_float(value, text);
    return strtod(text, NULL);
}
