/* Ray tracing in compute shaders: against closed forms, and pixel by pixel against the tracer on
 * the CPU, which shares its samples and rules but no code that meets a triangle. */
#include "renderer/blob/builder.h"
#include "tests/accuracy/textured.h"
#include "tests/unit/check.h"
#include <sys/mman.h>
#include <unistd.h>

#define SMALL "&width=96&height=72"
#define TINY "&width=32&height=24"
#define TINY_DOWN                                                                                  \
    "&width=32&height=32&ground=off&camera.eye=0,1,0&camera.target=0,0,0&camera.up=0,0,-1"         \
    "&camera.fov_y_deg=90"
#define DOWN                                                                                       \
    "&width=96&height=96&ground=off&camera.eye=0,1,0&camera.target=0,0,0&camera.up=0,0,-1"         \
    "&camera.fov_y_deg=90"
/* Under a caster at 0.6 m. */
#define BELOW                                                                                      \
    "&width=96&height=96&ground=off&camera.eye=0,0.5,0&camera.target=0,0,0&camera.up=0,0,-1"       \
    "&camera.fov_y_deg=130"
#define SUN "&light.type=sun&light.position=1,2,0.5"
#define SPHERE "&light.type=sphere&light.position=0.5,1.8,0.3&light.radius=0.3"
#define POINT "&light.type=point&light.position=0.5,1.8,0.3"
#define SPOT "&light.type=spot&light.position=0.5,1.8,0.3&light.target=0,0,0"
#define TEXTURED HARNESS_RECT "&light.texture.pattern=two-colour"

static void render(const uint8_t *id, const char *backend, uint32_t samples, const char *settings,
    struct shot *shot)
{
    char text[1024];
    snprintf(text, sizeof text, "technique=raytraced&backend=%s&samples=%u%s", backend, samples,
        settings);
    harness_shot(id, text, shot);
}

static bool ran(const struct shot *shot, const char *pass)
{
    for (uint32_t i = 0; i < shot->result.pass_count; i++)
        if (!strcmp(shot->result.passes[i].name, pass))
            return true;
    return false;
}

/* T6: what the mask hides of the light's image, both scaled onto the caster's plane and convolved.
 * The mask is the scene's own texture, exactly its texels. */
struct mask_case {
    struct planar_case planar;
    const uint8_t *alpha; /* RGBA8 */
    int side;
};

static double truth_mask(double x, double z, const void *user)
{
    enum { GRID = 40 };
    const struct mask_case *m = user;
    const struct planar_case *t = &m->planar;
    double k = (t->h - t->c) / t->h;
    int hidden = 0;
    for (int i = 0; i < GRID * GRID; i++) {
        double u = 2 * (i % GRID + 0.5) / GRID - 1, v = 2 * (i / GRID + 0.5) / GRID - 1;
        double px = x * k + (1 - k) * t->a * u, pz = z * k + (1 - k) * t->a * v;
        if (fabs(px) >= t->s || fabs(pz) >= t->s)
            continue;
        int tx = (int)((px + t->s) / (2 * t->s) * m->side);
        int ty = (int)((pz + t->s) / (2 * t->s) * m->side);
        hidden += m->alpha[4 * (ty * m->side + tx) + 3] > 127;
    }
    return 1 - (double)hidden / (GRID * GRID);
}

/* Every pixel within 3 standard errors but for one in a thousand, and the mean of all within 3 of
 * its own. An error cannot be estimated to better than a sample's worth. */
static void check_truth(const char *name, const uint8_t *id, const char *settings,
    truth_function truth, const void *user)
{
    enum { SAMPLES = 64 };
    struct shot shot;
    double sum = 0, variance = 0;
    uint32_t pixels = 0, outside = 0, partial = 0;
    render(id, "gpu", SAMPLES, settings, &shot);
    CHECK(ran(&shot, "ray samples") && shot.error);
    for (uint32_t i = 0; i < shot.width * shot.height; i++) {
        const float *p = shot.position + 4 * i;
        if (fabsf(p[1]) > 1e-3f || shot.normal[4 * i + 1] < 0.5f)
            continue;
        double expected = truth(p[0], p[2], user), error = shot.error[4 * i];
        double difference = shot.visibility[4 * i + 3] - expected;
        double error2 = error * error + 1.0 / SAMPLES / SAMPLES;
        outside += fabs(difference) > 3 * sqrt(error2);
        partial += expected > 0.02 && expected < 0.98;
        sum += difference;
        variance += error2;
        pixels++;
    }
    fprintf(stderr, "%-28s mean error %+.5f, beyond 3 SE: %u of %u, penumbra %u\n", name,
        sum / pixels, outside, pixels, partial);
    CHECK(pixels > 4000 && outside * 1000 <= pixels);
    CHECK(fabs(sum) <= 3 * sqrt(variance));
    harness_shot_finish(&shot);
}

static double truth_stacked(double x, double z, const void *user)
{
    const struct planar_case *t = user;
    struct planar_case upper = {1.2, t->h, t->a, 0};
    (void)z;
    /* Light points left of either edge, as seen from x, are hidden. */
    double k = upper.h / upper.c - 1;
    double lower_cut = -x * (t->h / t->c - 1), upper_cut = -0.6 - (x + 0.6) * k;
    double cut = fmax(lower_cut, upper_cut);
    return fmin(fmax((t->a - cut) / (2 * t->a), 0), 1);
}

static void check_mask(void)
{
    struct pen_generated_options options = {.kind = PEN_GENERATED_PLANAR_MASK};
    struct psc_scene scene;
    void *data;
    size_t bytes;
    uint8_t id[PEN_ID_BYTES];
    if (!pen_generate_blob(&options, &data, &bytes, NULL) ||
        !psc_open_memory(data, bytes, &scene, NULL))
        exit(1);
    const struct psc_image *image = &scene.images[0];
    struct mask_case t = {{1.2, 3, 0.5, 0.4}, scene.texels + image->first_byte, (int)image->width};
    harness_scene(&options, id);
    check_truth("T6", id, DOWN HARNESS_RECT, truth_mask, &t);
    free(data);
}

/* T7: what nothing shadows is lit exactly. */
static void check_lit(void)
{
    static const char *const lights[] = {
        HARNESS_RECT, HARNESS_DISK, SUN, SPHERE, POINT, SPOT, TEXTURED "&weighting=g"};
    uint8_t id[PEN_ID_BYTES];
    harness_scene(&(struct pen_generated_options){.kind = PEN_GENERATED_PLANE}, id);
    for (size_t i = 0; i < sizeof lights / sizeof *lights; i++) {
        char settings[512];
        struct shot shot;
        snprintf(settings, sizeof settings, TINY_DOWN "%s", lights[i]);
        render(id, "gpu", 32, settings, &shot);
        struct deviation d = harness_deviation(&shot, truth_one, NULL);
        if (d.worst > 0)
            fprintf(stderr, "T7%s: worst %.6f\n", lights[i], d.worst);
        CHECK(d.worst == 0 && d.pixels > 500);
        harness_shot_finish(&shot);
    }
}

static void check_closed_forms(void)
{
    uint8_t half[PEN_ID_BYTES], square[PEN_ID_BYTES], stacked[PEN_ID_BYTES];
    harness_scene(&(struct pen_generated_options){.kind = PEN_GENERATED_HALF_PLANE}, half);
    harness_scene(&(struct pen_generated_options){.kind = PEN_GENERATED_SQUARE}, square);
    harness_scene(&(struct pen_generated_options){.kind = PEN_GENERATED_STACKED}, stacked);
    struct planar_case t = {1.2, 3, 0.5, 0.4};
    check_truth("T1", half, DOWN HARNESS_RECT, truth_half_plane, &t);
    check_truth("T2", square, DOWN HARNESS_RECT, truth_square, &t);
    check_truth("T3", half, DOWN HARNESS_DISK, truth_half_plane_disk, &t);
    struct planar_case lower = {0.6, 3, 0.5, 0};
    check_truth("T4", stacked, BELOW HARNESS_RECT, truth_stacked, &lower);
    check_mask();
    check_lit();
    struct shot shot;
    double worst;
    render(half, "gpu", 64, DOWN TEXTURED, &shot);
    double rmse = textured_t5(&shot, &t, true, &worst);
    fprintf(stderr, "%-28s rmse %.5f, worst %.4f\n", "T5", rmse, worst);
    CHECK(rmse < 0.02 && worst < 0.06);
    harness_shot_finish(&shot);
}

struct compared {
    double rmse;
    uint32_t pixels, other; /* other: by more than one sample */
};

static struct compared compare(const struct shot *a, const struct shot *b, double sample)
{
    struct compared c = {.pixels = a->width * a->height};
    for (uint32_t i = 0; i < c.pixels; i++) {
        double worst = 0;
        for (int k = 0; k < 4; k++)
            worst = fmax(worst, fabs(a->visibility[4 * i + k] - b->visibility[4 * i + k]));
        worst = fmax(worst, fabs(a->error[4 * i] - b->error[4 * i]));
        c.rmse += worst * worst;
        c.other += worst > 1.01 * sample;
    }
    c.rmse = sqrt(c.rmse / c.pixels);
    return c;
}

/* Returns the rays of the GPU. */
static uint64_t check_backends(
    const char *name, const uint8_t *id, const char *settings, uint32_t samples)
{
    struct shot cpu, gpu;
    render(id, "cpu", samples, settings, &cpu);
    render(id, "gpu", samples, settings, &gpu);
    CHECK(cpu.error && gpu.error);
    struct compared c = compare(&cpu, &gpu, 1.0 / samples);
    uint64_t rays = gpu.result.rays;
    int64_t more = (int64_t)(rays - cpu.result.rays);
    fprintf(stderr, "%-28s rmse %.5f, %u of %u differ; rays %llu %+lld, full %u %+d\n", name,
        c.rmse, c.other, c.pixels, (unsigned long long)cpu.result.rays, (long long)more,
        cpu.result.full_work_pixels,
        (int)(gpu.result.full_work_pixels - cpu.result.full_work_pixels));
    /* A ray that grazes an edge may be decided either way by rounding; a sample has one ray. */
    CHECK(c.rmse < 0.05 / samples && c.other * 1000 <= c.pixels);
    CHECK(llabs(more) * 1000 <= (int64_t)rays);
    CHECK(ran(&cpu, "trace") && !ran(&cpu, "ray samples"));
    CHECK(ran(&gpu, "ray samples") && !ran(&gpu, "trace"));
    harness_shot_finish(&cpu);
    harness_shot_finish(&gpu);
    return rays;
}

static void add_sheet(struct psc_builder *b, const struct psc_material *material, float x, float z,
    float height, bool mirrored)
{
    static const float positions[4][3] = {{0, 0, 0}, {1, 0, 0}, {1, 0, 1}, {0, 0, 1}};
    static const float uv[4][2] = {{-0.7f, -0.6f}, {1.8f, -0.6f}, {1.8f, 1.9f}, {-0.7f, 1.9f}};
    static const float colors[4][4] = {
        {1, 1, 1, 1}, {1, 1, 1, 0.8f}, {1, 1, 1, 1}, {1, 1, 1, 0.6f}};
    static const uint32_t down[6] = {0, 1, 2, 0, 2, 3};
    struct psc_mesh mesh = {.positions = positions,
        .uv0 = uv,
        .colors = colors,
        .vertex_count = 4,
        .indices = down,
        .index_count = 6,
        .material = psc_builder_add_material(b, material)};
    uint32_t primitive;
    CHECK(psc_builder_add_mesh(b, &mesh, &primitive, NULL));
    const float world[12] = {1, 0, 0, x, 0, mirrored ? -1 : 1, 0, height, 0, 0, 1, z};
    psc_builder_add_instance(b, primitive, world);
}

/* Sheets of every kind of alpha over a floor: wrap modes, filters, sides, mirrored, two deep. */
static void sheets(uint8_t id[PEN_ID_BYTES])
{
    enum { SIDE = 4 };
    uint8_t rgba[SIDE * SIDE][4];
    struct pen_error error = {0};
    struct psc_builder *b = psc_builder_create();
    for (int i = 0; i < SIDE * SIDE; i++) {
        memset(rgba[i], 255, 3);
        rgba[i][3] = (uint8_t)(i * 101 % 256);
    }
    uint32_t image = psc_builder_add_image(b, SIDE, SIDE, false, rgba[0]);
    struct psc_material plain = psc_material_default();
    const float world[12] = {8, 0, 0, -4, 0, -1, 0, 0, 0, 0, 8, -4};
    add_sheet(b, &plain, 0, 0, -9, false); /* its meshes are the floor's too, below it */
    psc_builder_add_instance(b, 0, world);
    for (uint32_t i = 0; i < 12; i++) {
        struct psc_texture texture = {
            .image = image, .wrap_s = i % 3, .wrap_t = (i + 1) % 3, .nearest = i & 1 ? 15 : 0};
        struct psc_material m = psc_material_default();
        m.alpha_mode = i < 6 ? PSC_MASK : PSC_BLEND;
        m.alpha_cutoff = 0.4f;
        m.base_color[3] = 0.9f;
        m.flags = i % 4 == 3 ? 0 : PSC_DOUBLE_SIDED;
        m.base.texture = i % 5 == 4 ? -1 : (int32_t)psc_builder_add_texture(b, &texture);
        float x = (float)(i % 4) - 2, z = (float)(i / 4) - 1.5f;
        add_sheet(b, &m, x, z, 0.8f, i % 2);
        if (i % 3 == 0)
            add_sheet(b, &m, x + 0.2f, z, 0.9f, i % 2 == 0);
    }
    memset(id, 0, PEN_ID_BYTES);
    id[0] = 0x5e;
    void *data;
    size_t bytes;
    int fd = memfd_create("sheets", MFD_CLOEXEC);
    if (!psc_builder_finish(b, id, &data, &bytes, &error) || fd < 0 ||
        write(fd, data, bytes) != (ssize_t)bytes ||
        !pen_renderer_load_scene(harness_renderer(), id, fd, &error)) {
        fprintf(stderr, "sheets: %s\n", error.message);
        exit(1);
    }
    close(fd);
    free(data);
    psc_builder_destroy(b);
}

static bool has_cpu(void)
{
    const struct pen_technique_info *info =
        pen_catalogue_find(pen_renderer_catalogue(), "raytraced");
    const struct pen_param *backend = pen_param_find(info->params, "backend");
    for (uint32_t i = 0; backend->choices[i]; i++)
        if (!strcmp(backend->choices[i], "cpu"))
            return true;
    return false;
}

int main(void)
{
    uint8_t demo[PEN_ID_BYTES], alpha[PEN_ID_BYTES];
    check_closed_forms();
    if (!has_cpu()) /* built without Embree: nothing to compare with */
        CHECK_DONE();
    harness_scene(&(struct pen_generated_options){.kind = PEN_GENERATED_DEMO}, demo);
    sheets(alpha);
    check_backends("demo", demo, SMALL, 32);
    check_backends("demo, every pixel", demo, SMALL "&adaptive=false", 32);
    check_backends("demo, g", demo, SMALL "&weighting=g", 32);
    check_backends("demo, sphere", demo, SMALL SPHERE, 32);
    check_backends("demo, sun", demo, SMALL SUN, 32);
    check_backends("demo, point", demo, SMALL POINT, 32);
    check_backends("demo, spot", demo, SMALL SPOT, 32);
    check_backends("demo, disk", demo, SMALL HARNESS_DISK, 32);
    check_backends("demo, textured", demo, SMALL TEXTURED, 32);
    check_backends("demo, textured g", demo, SMALL TEXTURED "&weighting=g", 32);
    check_backends("sheets", alpha, DOWN HARNESS_RECT, 32);
    /* Receivers may stop after 256, 512, ... samples. */
    uint64_t all = check_backends("demo, 1024 samples", demo, TINY, 1024);
    uint64_t some = check_backends("demo, error 0.02", demo, TINY "&target_error=0.02", 1024);
    CHECK(some < all / 2);
    CHECK_DONE();
}
