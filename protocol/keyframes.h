/* A value that goes through given ones at given places. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

/* The value at `x`. `places` rise strictly; before the first and after the last the value holds still.
 * linear: straight from key to key. cubic: a cubic Hermite curve whose slope at a key is that of the
 * straight line between its two neighbours, at the ends that to the only one (with even places that is
 * the spline of Catmull and Rom 1974). */
double pen_keyframes_at(
    const double *places, const double *values, uint32_t count, bool cubic, double x);
