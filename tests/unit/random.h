/* The same numbers in every run, for tests that try many cases. *state is the seed. */
#pragma once
#include <stdint.h>

/* Multiplier and increment of Knuth's MMIX (The Art of Computer Programming, vol. 2, 3.3.4). */
static inline uint32_t next_random(uint64_t *state)
{
    *state = *state * 6364136223846793005u + 1442695040888963407u;
    return (uint32_t)(*state >> 33) << 1 ^ (uint32_t)(*state >> 20);
}

/* In [low, high). */
static inline double uniform(uint64_t *state, double low, double high)
{
    return low + (high - low) * next_random(state) / 4294967296.0;
}
