/* Numbers as decimal text. */
#pragma once

/* Shortest decimal text that reads back as the same number; `text` holds at least 32 bytes. */
void pen_print_float(float value, char *text);
void pen_print_double(double value, char *text);
/* The double of that shortest text: what a float was meant to be. It rounds to the same float. */
double pen_widen(float value);
