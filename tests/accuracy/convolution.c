/* csm and cssm: the series itself against its formula, linearity of the filter, and the closed
 * forms T1 to T4. */
#include "tests/accuracy/harness.h"
#include "tests/unit/check.h"

static void render(uint32_t kind, float height, const char *settings, struct shot *shot)
{
    uint8_t id[PEN_ID_BYTES];
    struct pen_generated_options options = {.kind = kind, .caster_height = height};
    harness_scene(&options, id);
    harness_shot(id, settings, shot);
}

/* The series of Annen et al. 2007 with damped coefficients, for a caster x behind the receiver. */
static double series(int terms, double damping, double x)
{
    double f = 0.5;
    for (int k = 1; k <= terms; k++)
        f += 2 / (M_PI * (2 * k - 1)) * exp(-damping * k * k / (double)(terms * terms)) *
             sin(M_PI * (2 * k - 1) * x);
    return fmin(fmax(f, 0), 1);
}

/* Visibility at the pixel whose position is nearest to (x, y, z). */
static double at(const struct shot *shot, double x, double y, double z)
{
    double best = INFINITY, v = NAN;
    for (uint32_t i = 0; i < shot->width * shot->height; i++) {
        const float *p = shot->position + 4 * i;
        double d = hypot(hypot(p[0] - x, p[1] - y), p[2] - z);
        if (d < best && shot->normal[4 * i + 1] > 0.5f)
            best = d, v = shot->visibility[4 * i + 3];
    }
    return v;
}

/* A view of the lower plate of the stacked scene (at 0.6), on which the upper one (at 1.2) casts:
 * its edge, at x = -0.6, projects to x = -0.8. Both planes fill the map, as the series assumes. */
#define PLATE_VIEW                                                                                 \
    "width=256&height=64&ground=off&camera.eye=-0.8,1.1,0&camera.target=-0.8,0,0&camera.up=0,0,-1" \
    "&camera.fov_y_deg=30"
static const double receiver_z = 2.4, caster_z = 1.8, edge_x = -0.8;
/* The depth range that the light is fitted with. */
static const double near_z = 1.8 * 0.999, far_z = 3 * 1.001;

static void check_series(void)
{
    static const struct {
        int terms;
        double damping, offset;
    } cases[] = {{4, 0, 0.5}, {4, 1, 0.5}, {8, 0.1, 0.3}, {8, 1, 0.5}, {8, 1, 0}, {16, 0.1, 0.3},
        {16, 1, 1}, {5, 0.5, 0.4}, {1, 0, 0.2}};
    for (uint32_t i = 0; i < sizeof cases / sizeof *cases; i++)
        for (int storage = 0; storage < 3; storage++) {
            static const char *const storages[] = {"rgba8", "rgba16", "tables"};
            char settings[512];
            int m = cases[i].terms;
            snprintf(settings, sizeof settings,
                "technique=csm&raw=on&radius=2&bias=0&terms=%d&damping=%g&offset=%g&storage=%s"
                "&" PLATE_VIEW HARNESS_RECT,
                m, cases[i].damping, cases[i].offset, storages[storage]);
            struct shot shot;
            render(PEN_GENERATED_STACKED, 1.2f, settings, &shot);
            double delta = cases[i].offset / m, range = 1 - 2 * delta;
            double gap = (caster_z - receiver_z) / (far_z - near_z) * range;
            /* A term is stored with half a quantum of error in each of sine and cosine. */
            double tolerance = storage == 0 ? m / 255.0 : 1e-3;
            CHECK_NEAR(
                at(&shot, -1.05, 0.6, 0), series(m, cases[i].damping, gap + delta), tolerance);
            CHECK_NEAR(at(&shot, -0.55, 0.6, 0), series(m, cases[i].damping, delta), tolerance);
            harness_shot_finish(&shot);
        }
}

/* Mean visibility within 0.25 m of the edge on the lower plate, at the middle row. */
static double mean_over_edge(const struct shot *shot)
{
    double sum = 0;
    uint32_t n = 0, row = shot->height / 2;
    for (uint32_t x = 0; x < shot->width; x++) {
        uint32_t i = row * shot->width + x;
        if (fabs(shot->position[4 * i] - edge_x) < 0.25) {
            sum += shot->visibility[4 * i + 3];
            n++;
        }
    }
    return sum / n;
}

/* The filter averages tests: a symmetric kernel over an edge keeps the sum of both sides.
 * The hard shadow of the same map says where its texels put the edge. Damped so far that
 * nothing is clamped. */
static void check_linearity(void)
{
#define FINE_VIEW                                                                                  \
    "width=1024&height=64&ground=off&camera.eye=-0.8,1.1,0&camera.target=-0.8,0,0"                 \
    "&camera.up=0,0,-1&camera.fov_y_deg=7.6"
    struct shot hard;
    render(
        PEN_GENERATED_STACKED, 1.2f, "technique=hard&map_size=1024&" FINE_VIEW HARNESS_RECT, &hard);
    double share = mean_over_edge(&hard);
    harness_shot_finish(&hard);
    for (int taps = 1; taps <= 4; taps *= 2) {
        char settings[512];
        struct shot shot;
        snprintf(settings, sizeof settings,
            "technique=csm&raw=on&damping=2&radius=12&taps=%d&" FINE_VIEW HARNESS_RECT, taps);
        render(PEN_GENERATED_STACKED, 1.2f, settings, &shot);
        double lit = at(&shot, -0.55, 0.6, 0), dark = at(&shot, -1.05, 0.6, 0);
        double mean = mean_over_edge(&shot), expected = dark + (lit - dark) * share;
        fprintf(stderr, "csm linearity, %d taps: %.5f, expected %.5f\n", taps, mean, expected);
        CHECK(lit - dark > 0.6);
        CHECK_NEAR(mean, expected, 1e-3);
        harness_shot_finish(&shot);
    }
}

/* csm: the width is the kernel's, whatever the caster's height. */
static void check_csm_width(void)
{
    static const float heights[] = {2.1f, 1.5f, 1.2f};
    for (int i = 0; i < 3; i++) {
        struct shot shot;
        render(PEN_GENERATED_HALF_PLANE, heights[i],
            "technique=csm&radius=24&taps=4&" HARNESS_VIEW HARNESS_RECT, &shot);
        /* The map spans the caster's 4 m and 1/256 on both sides, seen at the caster's depth. */
        double texel = 4 * (1 + 2.0 / 256) / 1024 * 3 / (3 - heights[i]);
        double expected = 0.8 * 48 * texel, width = harness_width_10_90(&shot);
        fprintf(stderr, "csm caster at %.1f: width %.4f, expected %.4f\n", (double)heights[i],
            width, expected);
        CHECK_NEAR(width, expected, 0.05 * expected);
        harness_shot_finish(&shot);
    }
}

static struct deviation check_closed(uint32_t kind, float height, const char *settings,
    truth_function truth, const struct planar_case *t, double limit)
{
    struct shot shot;
    render(kind, height, settings, &shot);
    struct deviation d = harness_deviation(&shot, truth, t);
    fprintf(stderr, "%-50.50s rmse %.5f penumbra %.5f worst %.4f\n", settings, d.rmse,
        d.rmse_penumbra, d.worst);
    CHECK(d.rmse < limit);
    CHECK(d.pixels > 5000);
    harness_shot_finish(&shot);
    return d;
}

static void check_cssm(const char *method)
{
    static const float heights[] = {2.1f, 1.5f, 1.2f};
    char settings[512];
    for (int i = 0; i < 3; i++) {
        struct planar_case t = {.c = heights[i], .h = 3, .a = 0.25};
        struct shot shot;
        snprintf(settings, sizeof settings,
            "%s&" HARNESS_VIEW "&light.type=rect&light.position=0,3,0&light.target=0,0,0"
            "&light.up=0,0,-1&light.width=0.5&light.height=0.5",
            method);
        render(PEN_GENERATED_HALF_PLANE, heights[i], settings, &shot);
        double expected = 0.8 * 2 * t.a * t.c / (t.h - t.c), width = harness_width_10_90(&shot);
        fprintf(
            stderr, "%s caster at %.1f: width %.4f, expected %.4f\n", method, t.c, width, expected);
        CHECK_NEAR(width, expected, 0.06 * expected);
        CHECK(harness_deviation(&shot, truth_half_plane, &t).rmse < 0.015);
        harness_shot_finish(&shot);
    }
    struct planar_case t = {.c = 1.2, .h = 3, .a = 0.5, .s = 0.4};
    snprintf(settings, sizeof settings, "%s&" HARNESS_VIEW HARNESS_RECT, method);
    check_closed(PEN_GENERATED_SQUARE, 1.2f, settings, truth_square, &t, 0.01);
    snprintf(settings, sizeof settings, "%s&" HARNESS_VIEW HARNESS_DISK, method);
    check_closed(PEN_GENERATED_HALF_PLANE, 1.2f, settings, truth_half_plane_disk, &t, 0.02);
}

/* T4: behind both plates no light is left, though the window sees two depths. */
static void check_leaks(const char *method)
{
    char settings[512];
    struct shot shot;
    snprintf(settings, sizeof settings,
        "%s&width=256&height=64&ground=off&camera.eye=-0.5,0.5,0&camera.target=-0.5,0,0"
        "&camera.up=0,0,-1&camera.fov_y_deg=30" HARNESS_RECT,
        method);
    render(PEN_GENERATED_STACKED, 1.2f, settings, &shot);
    double worst = 0;
    uint32_t pixels = 0;
    for (uint32_t i = 0; i < shot.width * shot.height; i++) {
        const float *p = shot.position + 4 * i;
        if (fabsf(p[1]) > 1e-3f || p[0] > -0.13f)
            continue;
        worst = fmax(worst, (double)shot.visibility[4 * i + 3]);
        pixels++;
    }
    fprintf(stderr, "%s T4: worst leak %.4f over %u pixels\n", method, worst, pixels);
    CHECK(pixels > 5000);
    CHECK(worst < 0.1);
    harness_shot_finish(&shot);
}

/* Two planes in one window: the width tells the blocker average, and 5 % of it are 0.02
 * of the depth range here. Without the offset lit texels count as half a blocker each,
 * and it must fail. */
static double two_plane_width_error(const char *method)
{
    char settings[512];
    struct shot shot;
    snprintf(settings, sizeof settings,
        "%s&" PLATE_VIEW "&light.type=rect&light.position=0,3,0&light.target=0,0,0&light.up=0,0,-1"
        "&light.width=0.5&light.height=0.5",
        method);
    render(PEN_GENERATED_STACKED, 1.2f, settings, &shot);
    double expected = 0.8 * 0.5 * (receiver_z - caster_z) / caster_z;
    double width = harness_width_10_90(&shot);
    fprintf(stderr, "%s two planes: width %.4f, expected %.4f\n", method, width, expected);
    harness_shot_finish(&shot);
    return fabs(width - expected) / expected;
}

int main(void)
{
    check_series();
    check_linearity();
    check_csm_width();
    check_cssm("technique=cssm");
    check_cssm("technique=cssm&terms=8&taps=4");
    check_cssm("technique=cssm&storage=tables&terms=8&taps=4");
    check_leaks("technique=cssm&storage=tables");
    check_leaks("technique=cssm");
    check_leaks("technique=cssm&terms=8&damping=1&offset=0.5");
    /* With mips the sum of few kernels is no box: from one and the same average, 2, 3, 5
     * and 6 lookups an axis make widths of -1, -6, 0 and +2 %. Five show the average, three
     * are the default. */
    CHECK(two_plane_width_error("technique=cssm&taps=5") < 0.02);
    CHECK(two_plane_width_error("technique=cssm") < 0.08);
    CHECK(two_plane_width_error("technique=cssm&storage=tables") < 0.05);
    /* Exact boxes: one lookup is a whole filter. */
    CHECK(two_plane_width_error("technique=cssm&storage=tables&taps=1&search_taps=1") < 0.1);
    CHECK(two_plane_width_error("technique=cssm&terms=8&taps=4") < 0.05);
    CHECK(two_plane_width_error("technique=cssm&offset=0&contact=off") > 0.1);
    CHECK_DONE();
}
