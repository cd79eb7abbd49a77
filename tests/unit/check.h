/* The few assertions our C tests use. A test is a program: exit 0 passed, 77
 * skipped, else failed. */
#pragma once
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

int check_failures __attribute__((weak)); /* one per program, whichever of its files checks */

#define CHECK(condition)                                                                           \
    do {                                                                                           \
        if (!(condition)) {                                                                        \
            fprintf(stderr, "%s:%d: failed: %s\n", __FILE__, __LINE__, #condition);                \
            check_failures++;                                                                      \
        }                                                                                          \
    } while (0)
#define CHECK_NEAR(a, b, tolerance)                                                                \
    do {                                                                                           \
        double check_a = (a), check_b = (b);                                                       \
        if (!(fabs(check_a - check_b) <= (tolerance))) {                                           \
            fprintf(stderr, "%s:%d: %s = %.9g, expected %.9g +- %.3g\n", __FILE__, __LINE__, #a,   \
                check_a, check_b, (double)(tolerance));                                            \
            check_failures++;                                                                      \
        }                                                                                          \
    } while (0)
#define CHECK_STR(a, b)                                                                            \
    do {                                                                                           \
        const char *check_a = (a), *check_b = (b);                                                 \
        if (strcmp(check_a, check_b)) {                                                            \
            fprintf(                                                                               \
                stderr, "%s:%d: \"%s\", expected \"%s\"\n", __FILE__, __LINE__, check_a, check_b); \
            check_failures++;                                                                      \
        }                                                                                          \
    } while (0)
#define CHECK_DONE() return check_failures ? 1 : 0
