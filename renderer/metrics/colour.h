/* Colour spaces of the FLIP metric: all doubles, D65 white. */
#pragma once

struct metrics_colour {
    double to_xyz[3][3], from_xyz[3][3]; /* linear RGB of the sRGB primaries */
    double white[3];                     /* XYZ of RGB (1,1,1) */
};

struct metrics_colour metrics_colour_srgb(void);
/* Display-encoded to linear, clamped to [0,1]. */
double metrics_decode(double value);
/* Linear RGB to YyCxCz, the linear opponent space of CIELAB's white; and back. */
void metrics_opponent(const struct metrics_colour *space, const double rgb[3], double ycc[3]);
void metrics_from_opponent(const struct metrics_colour *space, const double ycc[3], double rgb[3]);
/* Linear RGB to CIELAB with a and b scaled by 0.01 L (Hunt's effect). */
void metrics_hunt_lab(const struct metrics_colour *space, const double rgb[3], double lab[3]);
