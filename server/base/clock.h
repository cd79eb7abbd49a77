/* Monotonic time, in nanoseconds. */
#pragma once
#include <stdint.h>
#include <time.h>

static inline uint64_t clock_now_ns(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (uint64_t)t.tv_sec * 1000000000u + (uint64_t)t.tv_nsec;
}

static inline double clock_ms(uint64_t ns)
{
    return (double)ns / 1e6;
}

#define CLOCK_MS 1000000ull /* ns */
#define CLOCK_S 1000000000ull
