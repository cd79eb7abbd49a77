/* Jobs: sample nets, threads, the adaptive mode, stopping, weighting, layouts, refusals; and what a
 * camera sees. */
#include "renderer/trace/embree/internal.h"
#include "tests/unit/trace_fixture.h"

#define WIDTH 161
#define HEIGHT 119
#define PIXELS (WIDTH * HEIGHT)
#define RINGS 48

static const float wide[2] = {-8, 8};
static const float center[3] = {0.2f, 0.7f, -0.1f};
#define RADIUS 0.6f

/* A sphere of triangles over a ground plane. */
static struct pen_trace_scene *ball_scene(void)
{
    static float positions[(RINGS + 1) * (2 * RINGS + 1)][3];
    static uint32_t indices[RINGS * 2 * RINGS * 6];
    uint32_t count = 0, row = 2 * RINGS + 1;
    struct psc_builder *builder = psc_builder_create();
    for (uint32_t i = 0; i <= RINGS; i++)
        for (uint32_t j = 0; j < row; j++) {
            double theta = M_PI * i / RINGS, phi = M_PI * (j % (2 * RINGS)) / RINGS;
            float *p = positions[i * row + j];
            p[0] = (float)(sin(theta) * cos(phi)) * RADIUS + center[0];
            p[1] = (float)cos(theta) * RADIUS + center[1];
            p[2] = (float)(sin(theta) * sin(phi)) * RADIUS + center[2];
        }
    for (uint32_t i = 0; i < RINGS; i++)
        for (uint32_t j = 0; j < 2 * RINGS; j++) {
            uint32_t a = i * row + j, quad[6] = {a, a + 1, a + row, a + 1, a + row + 1, a + row};
            memcpy(indices + count, quad, sizeof quad);
            count += 6;
        }
    uint32_t material = add_plain_material(builder, false), primitive;
    add_rectangle(builder, wide, wide, 0, false, material, identity);
    struct psc_mesh mesh = {.positions = (const float(*)[3])positions,
        .vertex_count = (RINGS + 1) * row,
        .indices = indices,
        .index_count = count,
        .material = material};
    CHECK(psc_builder_add_mesh(builder, &mesh, &primitive, NULL));
    psc_builder_add_instance(builder, primitive, identity);
    return finish_scene(builder, NULL);
}

struct picture {
    float positions[PIXELS][3], normals[PIXELS][3], visibility[PIXELS][4], error[PIXELS];
    uint32_t instances[PIXELS], triangles[PIXELS], samples[PIXELS];
};

static struct pen_trace_camera camera(void)
{
    return pen_trace_camera_look_at((const float[]){2, 2, 3}, (const float[]){0, 0.4f, 0},
        (const float[]){0, 1, 0}, 45, WIDTH, HEIGHT);
}

static struct picture *take_picture(struct pen_trace_scene *scene)
{
    struct picture *p = calloc(1, sizeof *p);
    struct pen_trace_camera from = camera();
    struct pen_trace_hits hits = {p->positions[0], p->normals[0], p->instances, p->triangles};
    struct pen_error error = {0};
    CHECK(pen_trace_primary(scene, &from, 0, &hits, &error));
    return p;
}

static struct pen_trace_job job_for(const struct picture *p, uint32_t samples)
{
    return (struct pen_trace_job){.positions = p->positions[0],
        .normals = p->normals[0],
        .width = WIDTH,
        .height = HEIGHT,
        .samples = samples,
        .seed = 3};
}

static struct pen_trace_stats run(struct pen_trace_scene *scene,
    const struct pen_trace_light *light, const struct pen_trace_job *job, struct picture *p)
{
    struct pen_trace_result result = {p->visibility[0], p->error, p->samples};
    struct pen_trace_stats stats = {0};
    struct pen_error error = {0};
    CHECK(pen_trace_visibility(scene, light, job, &result, &stats, &error));
    CHECK_STR(error.message, "");
    return stats;
}

/* Every elementary interval of area 1 / count holds one point; pairs share a cell. */
static void test_nets(void)
{
    static uint32_t xs[4096], ys[4096];
    static uint8_t taken[4096];
    for (uint32_t bits = 0; bits <= 12; bits++)
        for (uint32_t seed = 0; seed < 3; seed++) {
            uint32_t count = 1u << bits, first = seed * count;
            CHECK(trace_samples_net(first, count, seed * 77, xs, ys));
            for (uint32_t split = 0; split <= bits; split++) {
                memset(taken, 0, sizeof taken);
                uint32_t full = 0;
                for (uint32_t i = 0; i < count; i++) {
                    uint32_t x = (uint32_t)((uint64_t)xs[i] << split >> 32);
                    uint32_t y = (uint32_t)((uint64_t)ys[i] << (bits - split) >> 32);
                    full += !taken[x << (bits - split) | y]++;
                }
                CHECK(full == count);
            }
            uint32_t x_bits = bits / 2, y_bits = bits ? (bits - 1) / 2 : 0;
            for (uint32_t i = 0; i + 1 < count; i += 2)
                CHECK(((uint64_t)(xs[i] ^ xs[i + 1]) << x_bits >> 32) == 0 &&
                      ((uint64_t)(ys[i] ^ ys[i + 1]) << y_bits >> 32) == 0);
        }
}

/* The estimated standard error is the true one within a factor: never below, at most 2.5 above. */
static void test_error_estimate(void)
{
    struct psc_builder *builder = psc_builder_create();
    const float x[2] = {-9, 0.1f};
    const float turn[12] = {0.8f, 0, -0.6f, 0, 0, 1, 0, 0, 0.6f, 0, 0.8f, 0};
    add_rectangle(builder, x, wide, 1.5f, false, add_plain_material(builder, false), turn);
    struct pen_trace_scene *scene = finish_scene(builder, NULL);
    struct receivers *r = grid_receivers((float[2]){-0.2f, 0.2f}, (float[2]){-0.2f, 0.2f});
    struct receivers *truth = grid_receivers((float[2]){-0.2f, 0.2f}, (float[2]){-0.2f, 0.2f});
    struct pen_trace_light light = downward_light(PEN_TRACE_RECT, 0.5f);
    struct pen_trace_job job = job_of(truth, 16384);
    trace(scene, &light, &job, truth);
    for (uint32_t samples = 64; samples <= 1024; samples *= 4)
        for (uint32_t target = 0; target < 2; target++) {
            double squares = 0, estimate = 0;
            job = job_of(r, samples);
            job.target_error = target ? 1e-9f : 0; /* never reached: several nets, not one */
            trace(scene, &light, &job, r);
            for (int i = 0; i < GRID * GRID; i++) {
                double d = (double)r->visibility[i][3] - (double)truth->visibility[i][3];
                squares += d * d;
                estimate += (double)r->error[i] * (double)r->error[i];
            }
            printf("%u samples: true error %.5f, estimated %.5f\n", samples,
                sqrt(squares / (GRID * GRID)), sqrt(estimate / (GRID * GRID)));
            CHECK(estimate > 0.9 * squares && estimate < 6.25 * squares);
        }
    free(r);
    free(truth);
    pen_trace_scene_destroy(scene);
}

static void test_threads_and_seeds(struct pen_trace_scene *scene, struct picture *p)
{
    struct pen_trace_light light = downward_light(PEN_TRACE_DISK, 0.4f);
    struct picture *other = take_picture(scene);
    for (int mode = 0; mode < 4; mode++) {
        struct pen_trace_job job = job_for(p, 512);
        job.adaptive = mode & 1;
        job.target_error = mode & 2 ? 0.005f : 0;
        job.threads = 1;
        struct pen_trace_stats one = run(scene, &light, &job, p);
        job.threads = 5;
        struct pen_trace_stats five = run(scene, &light, &job, other);
        CHECK(one.rays == five.rays && one.threads == 1 && five.threads == 5);
        CHECK(!memcmp(p->visibility, other->visibility, sizeof p->visibility));
        CHECK(!memcmp(p->error, other->error, sizeof p->error));
        CHECK(!memcmp(p->samples, other->samples, sizeof p->samples));
        job.seed++;
        run(scene, &light, &job, other);
        CHECK(memcmp(p->visibility, other->visibility, sizeof p->visibility));
    }
    free(other);
}

static void test_adaptive(struct pen_trace_scene *scene, struct picture *p)
{
    struct picture *other = take_picture(scene);
    struct pen_trace_light light = downward_light(PEN_TRACE_RECT, 0.5f);
    static const float texels[2 * 2 * 4] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 1, 1, 1, 0};
    light.columns = light.rows = 2;
    for (int mode = 0; mode < 4; mode++) {
        struct pen_trace_job job = job_for(p, 256);
        light.emission = mode & 1 ? texels : NULL;
        job.weighting = mode & 2 ? PEN_TRACE_G : PEN_TRACE_AREA;
        struct pen_trace_stats all = run(scene, &light, &job, p);
        job.adaptive = true;
        struct pen_trace_stats few = run(scene, &light, &job, other);
        double squares = 0;
        for (int i = 0; i < PIXELS; i++)
            for (int c = 0; c < 4; c++) {
                double d = (double)p->visibility[i][c] - (double)other->visibility[i][c];
                squares += d * d / (4 * PIXELS);
            }
        printf("adaptive, mode %d: %.1f %% in full, %.1f %% of the rays, RMSE %.6f\n", mode,
            100.0 * (double)few.full_receivers / (double)few.receivers,
            100.0 * (double)few.rays / (double)all.rays, sqrt(squares));
        CHECK(all.full_receivers == all.receivers && all.receivers == few.receivers);
        CHECK(few.full_receivers * 2 < few.receivers && few.rays * 2 < all.rays);
        CHECK(sqrt(squares) < 0.0005);
    }
    free(other);
}

static void test_target(struct pen_trace_scene *scene, struct picture *p)
{
    struct pen_trace_light light = downward_light(PEN_TRACE_RECT, 0.5f);
    struct pen_trace_job job = job_for(p, 4096);
    job.target_error = 0.002f;
    struct pen_trace_stats stats = run(scene, &light, &job, p);
    CHECK(stats.samples == 4096);
    uint64_t spent = 0;
    for (int i = 0; i < PIXELS; i++) {
        if (p->samples[i] == 0)
            continue;
        CHECK(p->samples[i] >= 256 && p->samples[i] <= 4096);
        CHECK(p->error[i] < 0.002f || p->samples[i] == 4096);
        spent += p->samples[i];
    }
    printf("error below 0.002: %.0f samples on average\n", (double)spent / (double)stats.receivers);
    CHECK(spent / stats.receivers < 1000);
}

/* Both weightings of a half-plane against sums over 400 x 400 light points. */
static void test_weighting(void)
{
    struct psc_builder *builder = psc_builder_create();
    add_rectangle(builder, (float[2]){-20, 0}, (float[2]){-20, 20}, 1, false,
        add_plain_material(builder, false), identity);
    struct pen_trace_scene *scene = finish_scene(builder, NULL);
    struct pen_trace_light light = downward_light(PEN_TRACE_RECT, 1.2f);
    static const float texels[2 * 4] = {1, 0.5f, 0, 1, 0, 0.5f, 2, 1};
    light.emission = texels;
    light.columns = 2;
    light.rows = 1;
    enum { COUNT = 6 };
    float positions[COUNT][3] = {{0}}, normals[COUNT][4] = {{0}}, visibility[COUNT][4];
    for (int i = 0; i < COUNT; i++) {
        positions[i][0] = 0.1f * (float)(i - 2);
        normals[i][0] = i < 3 ? 0 : 0.9f * (float)(i - 4);
        normals[i][1] = 2; /* any length */
    }
    struct pen_trace_job job = {.positions = positions[0],
        .normals = normals[0],
        .normal_stride = 4,
        .width = COUNT,
        .height = 1,
        .samples = 4096};
    struct pen_trace_result result = {.visibility = visibility[0]};
    for (job.weighting = PEN_TRACE_AREA; job.weighting <= PEN_TRACE_G; job.weighting++) {
        CHECK(pen_trace_visibility(scene, &light, &job, &result, NULL, NULL));
        for (int i = 0; i < COUNT; i++) {
            double sum[4] = {0}, weights = 0, x = (double)positions[i][0];
            for (int k = 0; k < 400 * 400; k++) {
                double u = 1.2 * ((k % 400 + 0.5) / 200 - 1), v = 1.2 * ((k / 400 + 0.5) / 200 - 1);
                double d[3] = {u - x, 3, v}, d2 = d[0] * d[0] + 9 + d[2] * d[2];
                double cosine = (double)normals[i][0] * d[0] + (double)normals[i][1] * 3;
                double w = job.weighting == PEN_TRACE_G ? fmax(cosine, 0) * 3 / (d2 * d2) : 1;
                bool seen = cosine > 0 && x + d[0] / 3 > 0;
                for (int c = 0; c < 4; c++)
                    sum[c] += seen ? w * (c == 3 ? 1 : (double)texels[(u > 0) * 4 + c]) : 0;
                weights += w;
            }
            for (int c = 0; c < 4; c++)
                CHECK_NEAR((double)visibility[i][c], sum[c] / weights, 0.003);
        }
    }
    pen_trace_scene_destroy(scene);
}

static void test_primary(struct pen_trace_scene *scene, const struct picture *p)
{
    int ball = 0, ground = 0, sky = 0;
    for (int i = 0; i < PIXELS; i++) {
        const float *x = p->positions[i], *n = p->normals[i];
        double eye[3] = {2 - (double)x[0], 2 - (double)x[1], 3 - (double)x[2]};
        if (p->instances[i] == PEN_TRACE_NONE) {
            sky++;
            CHECK(n[0] == 0 && n[1] == 0 && n[2] == 0 && p->triangles[i] == PEN_TRACE_NONE);
            continue;
        }
        CHECK((double)n[0] * eye[0] + (double)n[1] * eye[1] + (double)n[2] * eye[2] > 0);
        if (p->instances[i] == 0) {
            ground++;
            CHECK_NEAR((double)x[1], 0, 1e-5);
            CHECK(n[1] == 1 && p->triangles[i] < 2);
            continue;
        }
        double d[3], r2 = 0, along = 0;
        for (int c = 0; c < 3; c++) {
            d[c] = (double)(x[c] - center[c]);
            r2 += d[c] * d[c];
            along += d[c] * (double)n[c];
        }
        ball++; /* facets lie a little inside the sphere and tilt by half a step at most */
        CHECK(sqrt(r2) < (double)RADIUS * 1.0001 && sqrt(r2) > (double)RADIUS * 0.997);
        CHECK(along / sqrt(r2) > cos(1.5 * M_PI / RINGS));
        CHECK(p->triangles[i] < RINGS * 2 * RINGS * 2);
    }
    CHECK(ball > PIXELS / 20 && ground > PIXELS / 10);
    /* Every pixel's place projects to the pixel: seen from the eye, the picture's axes hold. */
    struct pen_trace_camera seen_by = camera();
    for (int i = 0; i < PIXELS; i += 37) {
        float d[3];
        for (int c = 0; c < 3; c++)
            d[c] = p->positions[i][c] - seen_by.eye[c];
        if (p->instances[i] == PEN_TRACE_NONE)
            continue;
        double focal = HEIGHT / 2.0 / tan(M_PI / 8), z = (double)trace_dot(d, seen_by.forward);
        CHECK_NEAR(
            WIDTH / 2.0 + focal * (double)trace_dot(d, seen_by.right) / z, i % WIDTH + 0.5, 0.01);
        CHECK_NEAR(
            HEIGHT / 2.0 - focal * (double)trace_dot(d, seen_by.up) / z, i / WIDTH + 0.5, 0.01);
    }
    (void)scene;
    (void)sky;
}

/* Positions as a depth buffer gives them: off along the view by up to 2^-17 of the distance. */
static void test_depth_error(struct pen_trace_scene *scene, struct picture *p)
{
    struct picture *off = take_picture(scene);
    struct pen_trace_light light = downward_light(PEN_TRACE_RECT, 0.5f);
    const float eye[3] = {2, 2, 3};
    double rmse[2];
    struct pen_trace_job job = job_for(p, 64);
    run(scene, &light, &job, p);
    for (int i = 0; i < PIXELS; i++) {
        float error = 0x1p-17f * (float)(i * 40503u % 65536u) / 32768 - 0x1p-17f;
        for (int c = 0; c < 3; c++)
            off->positions[i][c] += error * (off->positions[i][c] - eye[c]);
    }
    for (int fixed = 0; fixed < 2; fixed++) {
        job = job_for(off, 64);
        memcpy(job.eye, eye, sizeof eye);
        job.depth_error = fixed ? 0x1p-16f : 0;
        run(scene, &light, &job, off);
        double squares = 0;
        for (int i = 0; i < PIXELS; i++) {
            double d = (double)(off->visibility[i][3] - p->visibility[i][3]);
            squares += d * d;
        }
        rmse[fixed] = sqrt(squares / PIXELS);
    }
    printf("positions from depth: RMSE %.4f, lifted %.6f\n", rmse[0], rmse[1]);
    CHECK(rmse[0] > 0.05 && rmse[1] < 0.002);
    free(off);
}

/* A spot lights inside its cone only, and needs one ray a receiver. */
static void test_spot(struct pen_trace_scene *scene)
{
    struct receivers *r = grid_receivers((float[2]){-3, 3}, (float[2]){3, 6});
    struct pen_trace_light light = downward_light(PEN_TRACE_POINT, 0);
    light.cos_cone = 0.6f;
    struct pen_trace_job job = job_of(r, 64);
    trace(scene, &light, &job, r);
    int inside = 0;
    for (int i = 0; i < GRID * GRID; i++) {
        double x = (double)r->positions[i][0], z = (double)r->positions[i][2];
        bool lit = (double)LIGHT_Y / sqrt(x * x + z * z + 9) > (double)light.cos_cone;
        CHECK(r->visibility[i][3] == (lit ? 1 : 0) && r->error[i] == 0);
        inside += lit;
    }
    CHECK(inside > 500 && inside < 3500);
    free(r);
}

static void test_refusals(struct pen_trace_scene *scene, struct picture *p)
{
    struct pen_trace_light light = downward_light(PEN_TRACE_RECT, 0.5f);
    struct pen_trace_result result = {.visibility = p->visibility[0]};
    struct pen_trace_job good = job_for(p, 16), job;
    struct pen_error error;
#define REFUSED(code_, change)                                                                     \
    do {                                                                                           \
        job = good;                                                                                \
        error = (struct pen_error){0};                                                             \
        change;                                                                                    \
        CHECK(!pen_trace_visibility(scene, &light, &job, &result, NULL, &error));                  \
        CHECK(error.code == code_);                                                                \
    } while (0)
    REFUSED(PEN_INVALID, job.samples = 0);
    REFUSED(PEN_INVALID, job.samples = 65537);
    REFUSED(PEN_INVALID, job.width = 0);
    REFUSED(PEN_INVALID, (job.width = 1 << 16, job.height = 1 << 15));
    REFUSED(PEN_DEADLINE, job.deadline_ns = 1);
    REFUSED(PEN_INVALID, light.half[1] = 0);
    light.half[1] = NAN;
    REFUSED(PEN_INVALID, (void)0);
    light = downward_light(PEN_TRACE_POINT + 1, 1);
    REFUSED(PEN_INVALID, (void)0);

    /* What is no receiver is lit, whatever it holds. */
    light = downward_light(PEN_TRACE_RECT, 0.5f);
    const float positions[4][3] = {{NAN, 0, 0}, {0, 0, 0}, {0, 5, 0}, {0, 0.01f, 0}};
    const float normals[4][3] = {{0, 1, 0}, {0, 0, 0}, {0, -1, 0}, {0, -1, 0}};
    job = (struct pen_trace_job){
        .positions = positions[0], .normals = normals[0], .width = 4, .height = 1, .samples = 16};
    struct pen_trace_stats stats;
    CHECK(pen_trace_visibility(scene, &light, &job, &result, &stats, NULL));
    CHECK(p->visibility[0][3] == 1 && p->visibility[1][3] == 1);
    /* Behind the one-sided light, and looking away from it: dark without a ray. */
    CHECK(p->visibility[2][3] == 0 && p->visibility[3][3] == 0);
    CHECK(stats.rays == 0 && stats.receivers == 2);

    struct psc_builder *builder = psc_builder_create();
    uint32_t material = add_plain_material(builder, true);
    for (int i = 0; i < 100; i++)
        add_rectangle(builder, wide, wide, (float)i, false, material, identity);
    struct pen_trace_scene_options options = {.max_bytes = 20000};
    static const uint8_t source[PEN_ID_BYTES];
    struct psc_scene blob;
    void *data;
    size_t bytes;
    CHECK(psc_builder_finish(builder, source, &data, &bytes, NULL));
    CHECK(psc_open_memory(data, bytes, &blob, NULL));
    struct pen_trace_scene *small = pen_trace_scene_create(&blob, &options, &error);
    error = (struct pen_error){0};
    if (small) { /* the triangles may fit, the hierarchy does not */
        job = good;
        CHECK(!pen_trace_visibility(small, &light, &job, &result, NULL, &error));
        pen_trace_scene_destroy(small);
    }
    CHECK(error.code == PEN_TOO_BIG);
    options.max_bytes = 1000;
    error = (struct pen_error){0};
    CHECK(!pen_trace_scene_create(&blob, &options, &error) && error.code == PEN_TOO_BIG);
    free(data);
    psc_builder_destroy(builder);
}

/* Between two pieces of a job, other jobs with lights of their own trace the same scene; where only
 * fronts cast each of them has a hierarchy. */
struct guests {
    struct pen_trace_scene *scene;
    struct picture *picture;
    uint32_t calls, jobs, gives_up;
};

static struct pen_trace_light light_at(uint32_t place)
{
    struct pen_trace_light light = downward_light(PEN_TRACE_RECT, 0.5f);
    light.origin[0] = 0.1f * (float)place;
    return light;
}

static bool guest_turn(void *context)
{
    struct guests *g = context;
    g->calls++;
    if (g->jobs < 2 * TRACE_HIERARCHIES) {
        struct pen_trace_job job = job_for(g->picture, 4);
        struct pen_trace_light light = light_at(g->jobs++ % (TRACE_HIERARCHIES + 2));
        job.front_only = true;
        run(g->scene, &light, &job, g->picture);
    }
    return !g->gives_up || g->calls < g->gives_up;
}

static void test_turns(void)
{
    struct pen_trace_scene *scene = ball_scene();
    struct picture *alone = take_picture(scene), *beside = take_picture(scene);
    struct guests guests = {NULL, take_picture(scene), 0, 0, 0};
    struct pen_trace_light light = light_at(0);
    struct pen_trace_job job = job_for(alone, 64);
    job.front_only = true;
    run(scene, &light, &job, alone);
    pen_trace_scene_destroy(scene);
    job.turn = guest_turn;
    job.turn_context = &guests;
    for (job.threads = 1; job.threads < 4; job.threads++) {
        guests.scene = scene = ball_scene();
        guests.calls = guests.jobs = 0;
        run(scene, &light, &job, beside);
        /* How often the first thread is asked is its own only where no other takes its tiles. */
        CHECK(job.threads > 1 || guests.jobs == 2 * TRACE_HIERARCHIES);
        CHECK(!memcmp(alone->visibility, beside->visibility, sizeof alone->visibility));
        pen_trace_scene_destroy(scene);
    }
    /* Given up while the hierarchy is built, and later: nothing is left half made. */
    job.threads = 1;
    guests.scene = scene = ball_scene();
    for (guests.gives_up = 1; guests.gives_up < 20; guests.gives_up++) {
        struct pen_trace_result result = {beside->visibility[0], beside->error, beside->samples};
        struct pen_trace_stats stats;
        struct pen_error error = {0};
        guests.calls = guests.jobs = 0;
        light = light_at(guests.gives_up);
        CHECK(!pen_trace_visibility(scene, &light, &job, &result, &stats, &error));
    }
    guests.gives_up = 0;
    light = light_at(0);
    memset(beside->visibility, 0, sizeof beside->visibility);
    run(scene, &light, &job, beside);
    CHECK(!memcmp(alone->visibility, beside->visibility, sizeof alone->visibility));
    pen_trace_scene_destroy(scene);
    /* Where there is no time at all, every tile is followed by a turn, the first time too. */
    scene = ball_scene();
    job.turn = NULL;
    run(scene, &light, &job, alone); /* the hierarchy is built */
    job.turn = guest_turn;
    guests.jobs = 2 * TRACE_HIERARCHIES; /* no more */
    guests.calls = 0;
    run(scene, &light, &job, beside);
    CHECK(guests.calls >= 2 * PIXELS / (16 * 16)); /* what is no receiver, and rays */
    pen_trace_scene_destroy(scene);
    free(alone);
    free(beside);
    free(guests.picture);
}

/* As octahedral.glsl has it. */
static void encode_normal(const float n[3], uint16_t e[4])
{
    float sum = fabsf(n[0]) + fabsf(n[1]) + fabsf(n[2]), x = n[0] / sum, y = n[1] / sum;
    float folded_x = (1 - fabsf(y)) * (x >= 0 ? 1 : -1),
          folded_y = (1 - fabsf(x)) * (y >= 0 ? 1 : -1);
    e[0] = (uint16_t)lrintf(65535 * (0.5f * (n[2] >= 0 ? x : folded_x) + 0.5f));
    e[1] = (uint16_t)lrintf(65535 * (0.5f * (n[2] >= 0 ? y : folded_y) + 0.5f));
}

/* A camera's depths and normals are the receivers that they were made of. */
static void test_view(struct pen_trace_scene *scene, const struct picture *p)
{
    static float depths[PIXELS];
    static uint16_t normals[PIXELS][4];
    struct pen_trace_camera c = camera();
    struct pen_trace_view view = {.depths = depths, .normals = normals[0]};
    struct picture *other = take_picture(scene), *same = take_picture(scene);
    float scale = 2 * c.tan_half_fov_y / HEIGHT, near_z = 0.25f;
    for (int k = 0; k < 3; k++) {
        view.right[k] = near_z * scale * c.right[k];
        view.down[k] = -near_z * scale * c.up[k];
        view.first[k] = near_z * c.forward[k] - 0.5f * (WIDTH - 1) * view.right[k] -
                        0.5f * (HEIGHT - 1) * view.down[k];
    }
    for (uint32_t i = 0; i < PIXELS; i++) {
        float to[3], distance = 0, position[3], normal[3];
        for (int k = 0; k < 3; k++) {
            to[k] = p->positions[i][k] - c.eye[k];
            distance += to[k] * c.forward[k];
        }
        bool hit = p->instances[i] != PEN_TRACE_NONE;
        depths[i] = hit ? near_z / distance : 0;
        if (hit)
            encode_normal(p->normals[i], normals[i]);
        CHECK(pen_trace_view_read(&view, c.eye, WIDTH, i, position, normal) == hit);
        float length = hit ? sqrtf(trace_dot(normal, normal)) : 1;
        for (int k = 0; k < 3 && hit; k++) {
            CHECK_NEAR(position[k], p->positions[i][k], 1e-4);
            CHECK_NEAR(normal[k] / length, p->normals[i][k], 1e-4);
        }
    }
    struct pen_trace_light light = downward_light(PEN_TRACE_DISK, 0.4f);
    struct pen_trace_job job = job_for(p, 256);
    memcpy(job.eye, c.eye, sizeof job.eye);
    job.bias = 1e-3f;
    run(scene, &light, &job, same);
    job.positions = job.normals = NULL;
    job.view = &view;
    run(scene, &light, &job, other);
    double sum = 0;
    for (uint32_t i = 0; i < PIXELS; i++)
        sum += pow((double)same->visibility[i][3] - (double)other->visibility[i][3], 2);
    CHECK(sqrt(sum / PIXELS) < 0.003);
    free(other);
    free(same);
}

/* Halves are those next to their numbers. */
static void test_half(void)
{
    CHECK(pen_trace_half(0) == 0 && pen_trace_half(1) == 0x3c00 && pen_trace_half(0.5f) == 0x3800);
    CHECK(pen_trace_half(0x1p-24f) == 1 && pen_trace_half(0x1p-14f) == 0x0400);
    CHECK(pen_trace_half(1e9f) == 0x7bff && pen_trace_half(0x1.002p0f) == 0x3c00);
    CHECK(pen_trace_half(0x1.ffep-1f) == 0x3c00 && pen_trace_half(1.0f / 3) == 0x3555);
}

int main(void)
{
    test_nets();
    test_turns();
    test_error_estimate();
    struct pen_trace_scene *scene = ball_scene();
    struct picture *picture = take_picture(scene);
    test_primary(scene, picture);
    test_threads_and_seeds(scene, picture);
    test_adaptive(scene, picture);
    test_target(scene, picture);
    test_weighting();
    test_depth_error(scene, picture);
    test_view(scene, picture);
    test_half();
    test_spot(scene);
    test_refusals(scene, picture);
    free(picture);
    pen_trace_scene_destroy(scene);
    CHECK_DONE();
}
