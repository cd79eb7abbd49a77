/* Conversions after IEC 61966-2-1 and CIE 15. */
#include "renderer/metrics/colour.h"
#include "protocol/srgb.h"
#include <math.h>

static void multiply(const double m[3][3], const double v[3], double out[3])
{
    double r[3];
    for (int i = 0; i < 3; i++)
        r[i] = m[i][0] * v[0] + m[i][1] * v[1] + m[i][2] * v[2];
    for (int i = 0; i < 3; i++)
        out[i] = r[i];
}

static void invert(const double m[3][3], double out[3][3])
{
    double determinant = 0;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            int a = (j + 1) % 3, b = (j + 2) % 3, c = (i + 1) % 3, d = (i + 2) % 3;
            out[i][j] = m[a][c] * m[b][d] - m[a][d] * m[b][c];
        }
    for (int j = 0; j < 3; j++)
        determinant += m[0][j] * out[j][0];
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            out[i][j] /= determinant;
}

struct metrics_colour metrics_colour_srgb(void)
{
    /* Chromaticities of red, green, blue and of the white D65. */
    static const double xy[4][2] = {{0.64, 0.33}, {0.30, 0.60}, {0.15, 0.06}, {0.3127, 0.3290}};
    struct metrics_colour space;
    double primaries[3][3], inverse[3][3], scale[3];
    for (int i = 0; i < 3; i++) {
        primaries[0][i] = xy[i][0] / xy[i][1];
        primaries[1][i] = 1;
        primaries[2][i] = (1 - xy[i][0] - xy[i][1]) / xy[i][1];
    }
    space.white[0] = xy[3][0] / xy[3][1];
    space.white[1] = 1;
    space.white[2] = (1 - xy[3][0] - xy[3][1]) / xy[3][1];
    invert((const double(*)[3])primaries, inverse);
    multiply((const double(*)[3])inverse, space.white, scale);
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            space.to_xyz[i][j] = primaries[i][j] * scale[j];
    invert((const double(*)[3])space.to_xyz, space.from_xyz);
    return space;
}

double metrics_decode(double value)
{
    return pen_srgb_decode(fmin(fmax(value, 0), 1));
}

void metrics_opponent(const struct metrics_colour *space, const double rgb[3], double ycc[3])
{
    double xyz[3];
    multiply(space->to_xyz, rgb, xyz);
    for (int i = 0; i < 3; i++)
        xyz[i] /= space->white[i];
    ycc[0] = 116 * xyz[1] - 16;
    ycc[1] = 500 * (xyz[0] - xyz[1]);
    ycc[2] = 200 * (xyz[1] - xyz[2]);
}

void metrics_from_opponent(const struct metrics_colour *space, const double ycc[3], double rgb[3])
{
    double y = (ycc[0] + 16) / 116;
    double xyz[3] = {(y + ycc[1] / 500) * space->white[0], y * space->white[1],
        (y - ycc[2] / 200) * space->white[2]};
    multiply(space->from_xyz, xyz, rgb);
}

static double lab_curve(double t)
{
    const double d = 6.0 / 29;
    return t > d * d * d ? cbrt(t) : t / (3 * d * d) + 4.0 / 29;
}

void metrics_hunt_lab(const struct metrics_colour *space, const double rgb[3], double lab[3])
{
    double xyz[3];
    multiply(space->to_xyz, rgb, xyz);
    for (int i = 0; i < 3; i++)
        xyz[i] = lab_curve(xyz[i] / space->white[i]);
    lab[0] = 116 * xyz[1] - 16;
    lab[1] = 0.01 * lab[0] * 500 * (xyz[0] - xyz[1]);
    lab[2] = 0.01 * lab[0] * 200 * (xyz[1] - xyz[2]);
}
