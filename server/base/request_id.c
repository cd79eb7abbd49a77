#include "server/base/request_id.h"
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/random.h>

void request_id_make(char text[REQUEST_ID_BYTES])
{
    uint8_t random[16];
    if (getrandom(random, sizeof random, 0) != sizeof random)
        abort();
    for (int i = 0; i < 16; i++)
        snprintf(text + 2 * i, 3, "%02x", random[i]);
}
