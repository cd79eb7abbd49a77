/* Unshadowed light of area emitters on a plane of roughness 1: the closed-form irradiance
 * and the specular quadrature against Lambert's and the GGX integral summed over many points
 * of the emitter. */
#include "tests/accuracy/harness.h"
#include "tests/unit/check.h"
#include <math.h>

struct emitter {
    const char *name, *settings;
    double origin[3], x[3], y[3], z[3]; /* half axes; unit emission axis; a sphere's z is 0 */
    bool round;
    double tolerance; /* of the brightest receiver: the four cells of the specular part are coarse
                         where the light is near or the horizon takes whole ones */
};

static const double eye[3] = {0, 1, 0};
/* Of the generated plane: base colour 0.5, dielectric with F0 0.04, whose share
 * diffuse light lacks. */
static const double diffuse = 0.5 * 0.96 / M_PI, f0 = 0.04;

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void normalise(double a[3])
{
    double length = sqrt(dot(a, a));
    for (int i = 0; i < 3; i++)
        a[i] /= length;
}

/* glTF 2.0 appendix B at alpha 1, where the distribution is 1 / pi, plus the diffuse part. */
static double brdf(const double n[3], const double v[3], const double l[3])
{
    double h[3] = {v[0] + l[0], v[1] + l[1], v[2] + l[2]};
    normalise(h);
    double fresnel = f0 + (1 - f0) * pow(1 - dot(v, h), 5);
    return diffuse + fresnel / M_PI * 0.5 / (dot(n, l) + dot(n, v));
}

static void axes(const struct emitter *e, const double p[3], double x[3], double y[3], double z[3])
{
    for (int i = 0; i < 3; i++)
        x[i] = e->x[i], y[i] = e->y[i], z[i] = e->z[i];
    if (dot(z, z) > 0)
        return;
    double radius = sqrt(dot(e->x, e->x)), side[3];
    for (int i = 0; i < 3; i++)
        z[i] = p[i] - e->origin[i];
    double distance = sqrt(dot(z, z));
    /* The disk that covers the same directions as the sphere, through the sphere's centre. */
    radius *= 1 / sqrt(1 - radius * radius / (distance * distance));
    normalise(z);
    side[0] = z[1], side[1] = -z[0], side[2] = 0;
    normalise(side);
    for (int i = 0; i < 3; i++)
        x[i] = radius * side[i];
    y[0] = z[1] * x[2] - z[2] * x[1], y[1] = z[2] * x[0] - z[0] * x[2];
    y[2] = z[0] * x[1] - z[1] * x[0];
}

/* Radiance towards the eye under an emitter of radiance 1. */
static double summed(const struct emitter *e, const double p[3])
{
    enum { SIDE = 64 };
    double n[3] = {0, 1, 0}, x[3], y[3], z[3], sum = 0;
    double v[3] = {eye[0] - p[0], eye[1] - p[1], eye[2] - p[2]};
    normalise(v);
    axes(e, p, x, y, z);
    double cell = 4 * sqrt(dot(x, x) * dot(y, y)) / (SIDE * SIDE);
    for (int i = 0; i < SIDE * SIDE; i++) {
        double s = (i % SIDE + 0.5) / SIDE * 2 - 1, t = (i / SIDE + 0.5) / SIDE * 2 - 1;
        double to[3];
        if (e->round && s * s + t * t > 1)
            continue;
        for (int k = 0; k < 3; k++)
            to[k] = e->origin[k] + s * x[k] + t * y[k] - p[k];
        double square = dot(to, to);
        normalise(to);
        double receiver = dot(n, to), emitter = -dot(z, to);
        if (receiver > 0 && emitter > 0)
            sum += brdf(n, v, to) * receiver * emitter / square * cell;
    }
    return sum;
}

static void check(const uint8_t *plane, const struct emitter *e)
{
    char settings[768];
    struct shot shot;
    snprintf(settings, sizeof settings,
        "technique=none&sky=off&exposure_ev=0&light.radiance=1&width=48&height=48&ground="
        "off"
        "&camera.eye=0,1,0&camera.target=0,0,0&camera.up=0,0,-1&camera.fov_y_deg=120&%s",
        e->settings);
    harness_shot(plane, settings, &shot);
    double worst = 0, brightest = 0;
    for (uint32_t i = 0; i < shot.width * shot.height; i++) {
        const float *at = shot.position + 4 * i;
        double p[3] = {at[0], at[1], at[2]}, expected = summed(e, p);
        worst = fmax(worst, fabs((double)shot.beauty[4 * i] - expected));
        brightest = fmax(brightest, expected);
    }
    fprintf(stderr, "%-28s worst %.5f of %.5f\n", e->name, worst, brightest);
    CHECK(brightest > 0 && worst < e->tolerance * brightest);
    harness_shot_finish(&shot);
}

int main(void)
{
    static const struct emitter emitters[] = {
        {"rectangle overhead",
            "light.type=rect&light.position=0.5,3,0&light.target=0.5,0,0&light.up=0,0,-1"
            "&light.width=1&light.height=2",
            {0.5, 3, 0}, {0.5, 0, 0}, {0, 0, 1}, {0, -1, 0}, false, 0.01},
        {"rectangle under 90 degrees up",
            "light.type=rect&light.position=0,1.5,0&light.target=0,0,0&light.up=0,0,-1"
            "&light.width=6&light.height=6",
            {0, 1.5, 0}, {3, 0, 0}, {0, 0, 3}, {0, -1, 0}, false, 0.03},
        {"rectangle half below ground",
            "light.type=rect&light.position=3,0.2,0&light.target=-1,0.2,0&light.up=0,1,0"
            "&light.width=1&light.height=1",
            {3, 0.2, 0}, {0, 0, 0.5}, {0, 0.5, 0}, {-1, 0, 0}, false, 0.06},
        {"disk",
            "light.type=disk&light.position=0.5,2,0&light.target=0.5,0,0&light.up=0,0,-1"
            "&light.radius=0.7",
            {0.5, 2, 0}, {0.7, 0, 0}, {0, 0, 0.7}, {0, -1, 0}, true, 0.01},
        {"sphere", "light.type=sphere&light.position=0.5,2,0.2&light.radius=0.5", {0.5, 2, 0.2},
            {0.5, 0, 0}, {0, 0.5, 0}, {0}, true, 0.02},
    };
    uint8_t plane[PEN_ID_BYTES];
    harness_scene(&(struct pen_generated_options){.kind = PEN_GENERATED_PLANE}, plane);
    for (uint32_t i = 0; i < sizeof emitters / sizeof *emitters; i++)
        check(plane, &emitters[i]);
    CHECK_DONE();
}
