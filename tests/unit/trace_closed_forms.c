/* The ray tracer against closed forms: a straight edge under a square, a disk, a sphere and
 * the sun; a square caster; stacked and duplicate casters; a two-coloured light; a cut-out;
 * a lit plane. */
#include "tests/unit/trace_fixture.h"

#define HALF 0.5f /* of the light */
static const float far_left[2] = {-20, 0}, far_both[2] = {-20, 20};
static const float square[2] = {-0.3f, 0.4f}; /* a caster's extent along x and along z */

struct edge {
    double height; /* of the caster */
    double radius; /* of a round light; sun: times the light's distance */
    double from;   /* the light's distance: LIGHT_Y, or infinite for the sun */
};

/* Where the edge x = 0 cuts the light, as seen from x, in half-extents; the light
 * beyond is hidden. */
static double cut_of(const struct edge *e, double x, double half)
{
    if (isinf(e->from))
        return -x / (e->height * half);
    return -x * (e->from - e->height) / e->height / half;
}

static double truth_square(const void *context, const float p[3])
{
    return fmin(fmax(0.5 - 0.5 * cut_of(context, (double)p[0], HALF), 0), 1);
}

static double truth_disk(const void *context, const float p[3])
{
    const struct edge *e = context;
    double u = fmin(fmax(-cut_of(e, (double)p[0], e->radius), -1), 1);
    return 0.5 + (u * sqrt(1 - u * u) + asin(u)) / M_PI;
}

static double truth_red(const void *context, const float p[3])
{
    return fmax(0, -fmin(fmax(cut_of(context, (double)p[0], HALF), -1), 1)) / 2;
}

static double truth_green(const void *context, const float p[3])
{
    return (1 - fmax(0, fmin(fmax(cut_of(context, (double)p[0], HALF), -1), 1))) / 2;
}

/* The share of the light's [-HALF, HALF] that a caster's [c0, c1] at `height` hides from r. */
static double hidden(double c0, double c1, double height, double r)
{
    double scale = (double)LIGHT_Y / height;
    double s0 = r + (c0 - r) * scale, s1 = r + (c1 - r) * scale;
    return fmax(0, fmin((double)HALF, s1) - fmax(-(double)HALF, s0)) / (2 * (double)HALF);
}

static double truth_caster(const void *context, const float p[3])
{
    double height = *(const double *)context;
    return 1 - hidden((double)square[0], (double)square[1], height, (double)p[0]) *
                   hidden((double)square[0], (double)square[1], height, (double)p[2]);
}

static double truth_constant(const void *context, const float p[3])
{
    (void)p;
    return *(const double *)context;
}

static struct pen_trace_scene *edge_scene(double height)
{
    struct psc_builder *builder = psc_builder_create();
    uint32_t material = add_plain_material(builder, false);
    add_rectangle(builder, far_left, far_both, (float)height, false, material, identity);
    return finish_scene(builder, NULL);
}

static const float view[2] = {-0.9f, 1.1f}, deep[2] = {-1, 1};

static void test_edge(void)
{
    const double heights[3] = {0.6, 1.5, 2.1};
    for (int i = 0; i < 3; i++) {
        struct edge edge = {heights[i], (double)HALF, (double)LIGHT_Y};
        struct pen_trace_scene *scene = edge_scene(heights[i]);
        struct receivers *r = grid_receivers(view, deep);
        double rmse[3];
        for (int k = 0; k < 3; k++) { /* 16, 64, 256 samples */
            uint32_t samples = 16u << (2 * k);
            struct pen_trace_job job = job_of(r, samples);
            struct pen_trace_light light = downward_light(PEN_TRACE_RECT, HALF);
            trace(scene, &light, &job, r);
            rmse[k] = check_truth("T1 edge, square", r, 3, truth_square, &edge, samples);
            for (int c = 0; c < 3; c++) /* no emission: all channels alike */
                CHECK(r->visibility[77][c] == r->visibility[77][3]);
        }
        /* Random samples would halve the error; a net quarters it on such an edge. */
        CHECK(rmse[1] < 0.35 * rmse[0] && rmse[2] < 0.35 * rmse[1] && rmse[2] < 0.0021);

        struct pen_trace_light round[2] = {
            downward_light(PEN_TRACE_DISK, HALF), downward_light(PEN_TRACE_SUN, 0.2f)};
        for (int k = 0; k < 2; k++) {
            struct edge shape = edge;
            if (round[k].type == PEN_TRACE_SUN)
                shape = (struct edge){heights[i], 0.2, INFINITY};
            struct pen_trace_job job = job_of(r, 256);
            trace(scene, &round[k], &job, r);
            double error =
                check_truth(k ? "T1 edge, sun" : "T3 edge, disk", r, 3, truth_disk, &shape, 256);
            CHECK(error < 0.006);
        }
        free(r);
        pen_trace_scene_destroy(scene);
    }
}

static void test_sphere(void)
{
    /* Right below the edge the disk that faces the receiver is the horizontal one. */
    struct edge edge = {1.5, (double)HALF, (double)LIGHT_Y};
    struct pen_trace_scene *scene = edge_scene(1.5);
    const float narrow[2] = {-0.05f, 0.05f};
    struct receivers *r = grid_receivers(narrow, narrow);
    struct pen_trace_job job = job_of(r, 256);
    struct pen_trace_light light = downward_light(PEN_TRACE_SPHERE, HALF);
    trace(scene, &light, &job, r);
    check_truth("T3 edge, sphere", r, 3, truth_disk, &edge, 256);
    free(r);
    pen_trace_scene_destroy(scene);
}

/* Elsewhere: points of the disk that faces the receiver, counted one by one. */
static double truth_sphere(const void *context, const float p[3])
{
    double height = *(const double *)context, to[3], length = 0;
    int seen = 0;
    enum { RINGS = 80, SPOKES = 160 };
    for (int c = 0; c < 3; c++) {
        to[c] = (c == 1 ? (double)LIGHT_Y : 0) - (double)p[c];
        length += to[c] * to[c];
    }
    for (int c = 0; c < 3; c++)
        to[c] /= sqrt(length);
    double side[3] = {to[1], -to[0], 0}, norm = hypot(to[0], to[1]);
    double up[3] = {-side[1] * to[2] / norm, side[0] * to[2] / norm,
        (side[1] * to[0] - side[0] * to[1]) / norm};
    for (int i = 0; i < RINGS * SPOKES; i++) {
        double radius = (double)HALF * sqrt((i / SPOKES + 0.5) / RINGS);
        double angle = 2 * M_PI * (i % SPOKES + 0.5) / SPOKES;
        double u = radius * cos(angle), v = radius * sin(angle);
        double x = u * side[0] / norm + v * up[0],
               y = (double)LIGHT_Y + u * side[1] / norm + v * up[1];
        seen += (double)p[0] + (x - (double)p[0]) * height / y > 0;
    }
    return (double)seen / (RINGS * SPOKES);
}

static void test_sphere_aside(void)
{
    double height = 1.5;
    struct pen_trace_scene *scene = edge_scene(height);
    struct receivers *r = grid_receivers((float[2]){-1, 1}, (float[2]){2, 5});
    struct pen_trace_job job = job_of(r, 256);
    struct pen_trace_light light = downward_light(PEN_TRACE_SPHERE, HALF);
    for (int i = 0; i < GRID * GRID; i++)
        r->positions[i][0] *= i & 1 ? 1 : 0.25f;
    trace(scene, &light, &job, r);
    CHECK(check_truth("edge, sphere, aside", r, 3, truth_sphere, &height, 256) < 0.008);
    free(r);
    pen_trace_scene_destroy(scene);
}

static void test_square_caster(void)
{
    double height = 1.2;
    struct psc_builder *builder = psc_builder_create();
    add_rectangle(
        builder, square, square, (float)height, false, add_plain_material(builder, true), identity);
    struct pen_trace_scene *scene = finish_scene(builder, NULL);
    struct receivers *r = grid_receivers(view, view);
    for (uint32_t samples = 64; samples <= 1024; samples *= 4) {
        struct pen_trace_job job = job_of(r, samples);
        struct pen_trace_light light = downward_light(PEN_TRACE_RECT, HALF);
        trace(scene, &light, &job, r);
        check_truth("T2 square caster", r, 3, truth_caster, &height, samples);
    }
    free(r);
    pen_trace_scene_destroy(scene);
}

static void test_stacked(void)
{
    struct psc_builder *builder = psc_builder_create();
    uint32_t material = add_plain_material(builder, false);
    double zero = 0;
    add_rectangle(builder, far_both, far_both, 2.4f, false, material, identity);
    add_rectangle(builder, far_both, far_both, 0.6f, false, material, identity);
    struct pen_trace_scene *scene = finish_scene(builder, NULL);
    struct receivers *r = grid_receivers(view, view);
    struct pen_trace_job job = job_of(r, 64);
    struct pen_trace_light light = downward_light(PEN_TRACE_RECT, HALF);
    trace(scene, &light, &job, r);
    CHECK(check_truth("T4 stacked casters", r, 3, truth_constant, &zero, 64) == 0);
    free(r);
    pen_trace_scene_destroy(scene);
}

/* Two casters that hide the same half of the light from x = 0 hide no more than one of them. */
static void test_duplicate(void)
{
    struct psc_builder *builder = psc_builder_create();
    uint32_t material = add_plain_material(builder, false);
    double half = 0.5;
    const float line[2] = {0, 0};
    add_rectangle(builder, far_left, far_both, 2, false, material, identity);
    add_rectangle(builder, far_left, far_both, 1, false, material, identity);
    struct pen_trace_scene *scene = finish_scene(builder, NULL);
    struct receivers *r = grid_receivers(line, deep);
    struct pen_trace_job job = job_of(r, 256);
    struct pen_trace_light light = downward_light(PEN_TRACE_RECT, HALF);
    trace(scene, &light, &job, r);
    CHECK(check_truth("duplicate casters", r, 3, truth_constant, &half, 256) < 0.002);
    free(r);
    pen_trace_scene_destroy(scene);
}

static void test_colours(void)
{
    static const float red_green[8] = {1, 0, 0, 1, 0, 1, 0, 1};
    struct edge edge = {1.2, (double)HALF, (double)LIGHT_Y};
    struct pen_trace_scene *scene = edge_scene(edge.height);
    struct receivers *r = grid_receivers(view, deep);
    struct pen_trace_light light = downward_light(PEN_TRACE_RECT, HALF);
    light.emission = red_green;
    light.columns = 2;
    light.rows = 1;
    for (int adaptive = 0; adaptive < 2; adaptive++) {
        struct pen_trace_job job = job_of(r, 256);
        job.adaptive = adaptive;
        trace(scene, &light, &job, r);
        check_truth("T5 red half", r, 0, truth_red, &edge, 256);
        check_truth("T5 green half", r, 1, truth_green, &edge, 256);
        double zero = 0;
        CHECK(check_truth("T5 no blue", r, 2, truth_constant, &zero, 256) == 0);
        check_truth("T5 mean", r, 3, truth_square, &edge, 256);
    }
    free(r);
    pen_trace_scene_destroy(scene);
}

#define MASK 8
struct cut_out {
    uint8_t rgba[MASK * MASK][4];
    double height;
};

static double truth_mask(const void *context, const float p[3])
{
    const struct cut_out *mask = context;
    double v = 1, from = (double)square[0], step = (double)(square[1] - square[0]) / MASK;
    for (int i = 0; i < MASK * MASK; i++) {
        double x0 = from + i % MASK * step, z0 = from + i / MASK * step;
        if (mask->rgba[i][3] >= 128)
            v -= hidden(x0, x0 + step, mask->height, (double)p[0]) *
                 hidden(z0, z0 + step, mask->height, (double)p[2]);
    }
    return v;
}

static void test_cut_out(void)
{
    struct cut_out mask = {.height = 1.8};
    uint32_t bits = 12345;
    for (int i = 0; i < MASK * MASK; i++) {
        bits = bits * 1664525u + 1013904223u;
        mask.rgba[i][3] = bits >> 31 ? 255 : 40;
    }
    struct psc_builder *builder = psc_builder_create();
    struct psc_texture texture = {
        .image = psc_builder_add_image(builder, MASK, MASK, true, mask.rgba[0]), .nearest = 15};
    struct psc_material material = psc_material_default();
    material.flags = PSC_DOUBLE_SIDED;
    material.alpha_mode = PSC_MASK;
    material.alpha_cutoff = 0.5f;
    material.base.texture = (int32_t)psc_builder_add_texture(builder, &texture);
    add_rectangle(builder, square, square, (float)mask.height, false,
        psc_builder_add_material(builder, &material), identity);
    struct pen_trace_scene *scene = finish_scene(builder, NULL);
    CHECK(pen_trace_scene_info(scene).alpha == 2);
    struct receivers *r = grid_receivers(view, view);
    struct pen_trace_job job = job_of(r, 1024);
    struct pen_trace_light light = downward_light(PEN_TRACE_RECT, HALF);
    trace(scene, &light, &job, r);
    check_truth("T6 cut-out caster", r, 3, truth_mask, &mask, 1024);
    free(r);
    pen_trace_scene_destroy(scene);
}

static void test_lit_plane(void)
{
    for (int degrees = 5; degrees <= 85; degrees += 10) {
        /* A lit plane through the origin that casts, hit at `degrees` from grazing. */
        double tilt = (90 - degrees) * M_PI / 180, one = 1;
        float c = (float)cos(tilt), s = (float)sin(tilt);
        const float world[12] = {c, -s, 0, 0, s, c, 0, 0, 0, 0, 1, 0};
        struct psc_builder *builder = psc_builder_create();
        add_rectangle(
            builder, far_both, far_both, 0, false, add_plain_material(builder, false), world);
        struct pen_trace_scene *scene = finish_scene(builder, NULL);
        const float small[2] = {-0.1f, 0.1f};
        struct receivers *r = grid_receivers(small, small);
        for (int i = 0; i < GRID * GRID; i++) {
            float x = r->positions[i][0];
            r->positions[i][0] = c * x;
            r->positions[i][1] = s * x;
            r->normals[i][0] = -s;
            r->normals[i][1] = c;
        }
        struct pen_trace_job job = job_of(r, 64);
        struct pen_trace_light light = downward_light(PEN_TRACE_RECT, 0.05f);
        trace(scene, &light, &job, r);
        CHECK(check_truth("T7 lit plane", r, 3, truth_constant, &one, 64) == 0);
        free(r);
        pen_trace_scene_destroy(scene);
    }
}

int main(void)
{
    test_edge();
    test_sphere();
    test_sphere_aside();
    test_square_caster();
    test_stacked();
    test_duplicate();
    test_colours();
    test_cut_out();
    test_lit_plane();
    CHECK_DONE();
}
