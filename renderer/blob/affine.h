/* Row-major 3x4 matrices in double precision. */
#pragma once
#include <math.h>

static inline void psc_affine_multiply(const double a[12], const double b[12], double out[12])
{
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 4; c++)
            out[4 * r + c] = a[4 * r] * b[c] + a[4 * r + 1] * b[4 + c] + a[4 * r + 2] * b[8 + c] +
                             (c == 3 ? a[4 * r + 3] : 0);
}

/* T R S; the quaternion (x, y, z, w) need not be of unit length, zero is no rotation. */
static inline void psc_affine_trs(
    const float t[3], const float q[4], const float s[3], double out[12])
{
    double x = q[0], y = q[1], z = q[2], w = q[3];
    double n = x * x + y * y + z * z + w * w;
    double k = n > 0 ? 2 / n : 0;
    const double r[9] = {1 - k * (y * y + z * z), k * (x * y - z * w), k * (x * z + y * w),
        k * (x * y + z * w), 1 - k * (x * x + z * z), k * (y * z - x * w), k * (x * z - y * w),
        k * (y * z + x * w), 1 - k * (x * x + y * y)};
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++)
            out[4 * i + j] = r[3 * i + j] * s[j];
        out[4 * i + 3] = t[i];
    }
}

static inline void psc_affine_point(const double m[12], const double p[3], double out[3])
{
    for (int r = 0; r < 3; r++)
        out[r] = m[4 * r] * p[0] + m[4 * r + 1] * p[1] + m[4 * r + 2] * p[2] + m[4 * r + 3];
}

/* Column `axis` times `sign`, of unit length; returns the column's length (0: *out is that axis of
 * the world). */
static inline double psc_affine_axis(const double m[12], int axis, double sign, double out[3])
{
    double v[3] = {m[axis], m[4 + axis], m[8 + axis]};
    double length = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    for (int i = 0; i < 3; i++)
        out[i] = sign * (length > 0 ? v[i] / length : i == axis);
    return length;
}
