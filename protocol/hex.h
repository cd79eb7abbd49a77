/* Hexadecimal digits. */
#pragma once

/* The digit's value, of either case; -1: it is none. */
static inline int pen_hex_digit(char c)
{
    if (c >= '0' && c <= '9')
        return c - '0';
    c |= 0x20;
    return c >= 'a' && c <= 'f' ? c - 'a' + 10 : -1;
}
