/* Rays in compute shaders. Work is cut into short dispatches, each flushed on its own, so that no
 * driver's watchdog takes a long job for a hang. */
#include "renderer/passes/draw/show.h"
#include "renderer/passes/draw/turn.h"
#include "renderer/passes/rays/ray_scene.h"
#include "renderer/passes/rays/rays.h"
#include "renderer/trace/points.h"
#include <math.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define RAYS_PER_DISPATCH (1u << 21) /* milliseconds on a GPU */
#define RAYS_ON_SOFTWARE (1u << 15)  /* of the first, before its speed is known */
#define RECEIVERS_PER_DISPATCH (1u << 17)
#define RECEIVERS_IN_STEPS (1u << 22)  /* most whose sums all stay from block to block */
#define POINTS_PER_DISPATCH (1u << 12) /* one invocation takes them one after the other */
#define POINTS_ON_SOFTWARE 16u /* leaves 4096 turns of llvmpipe's loops for a ray: ray_bvh.glsl */

#define SHARED_ROWS "renderer/shaders/rays/ray_job.def"
#include "renderer/shared/rows_c.h"
#define SHARED_ROWS "renderer/shaders/rays/ray_samples.def"
#include "renderer/shared/rows_c.h"

struct work {
    struct technique_run *run;
    const struct ray_job *job;
    struct ray_targets *targets;
    const struct ray_scene *scene;
    struct pen_trace_light light;
    struct trace_points points;
    uint32_t samples, listed;
    uint32_t rays;                  /* that the next dispatch should trace */
    bool in_steps;                  /* all receivers take a block before the next one begins */
    bool enough;                    /* there are no more wanted */
    bool cut_short;                 /* what was traced is of no use */
    const struct gl_target *marked; /* IMAGE_MARKS; NULL: nothing */
    bool pretest;
    char defines[512];
};

static void make_defines(struct work *w)
{
    bool point = w->light.type == PEN_TRACE_POINT, textured = w->run->face->textured;
    bool weights = w->job->weighting == PEN_TRACE_G && !point;
    snprintf(w->defines, sizeof w->defines,
        "#define LIGHT_TYPE %u\n#define PRETEST_NET %uu\n#define PRETEST_RIM %uu\n"
        "#define DILATION %u\n#define LEAST_SHARE %.9g\n%s%s%s%s%s%s",
        w->light.type, TRACE_PRETEST_NET, TRACE_PRETEST_RIM, TRACE_DILATION,
        (double)TRACE_LEAST_SHARE, w->scene->alpha_triangles ? "#define ALPHA\n" : "",
        textured ? "#define COLOUR\n" : "", weights ? "#define WEIGHTS\n" : "",
        w->pretest ? "" : "#define EVERY\n", weights && textured ? "#define LIT_NEEDS_SUM\n" : "",
        w->run->request->casters == PEN_CASTERS_FRONT ? "#define FRONT_ONLY\n" : "");
}

static GLuint program(const struct work *w, const char *file, struct pen_error *error)
{
    struct gl_program_desc desc = {.compute = file, .defines = w->defines};
    return gl_programs_get(w->run->ctx->programs, &desc, error);
}

static void bind(const struct work *w);

/* One piece of work, and then somebody else's turn. */
static bool dispatch(struct work *w, GLuint name, uint32_t x, uint32_t y, struct pen_error *error)
{
    struct technique_ctx *ctx = w->run->ctx;
    double start = gl_now_ms();
    gl.UseProgram(name);
    gl.DispatchCompute(x, y, 1);
    gl.MemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_SHADER_IMAGE_ACCESS_BARRIER_BIT |
                     GL_TEXTURE_FETCH_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT);
    gl.Flush();
    uint32_t turn = ctx->turns.number;
    if (ctx->software && isfinite(ctx->turns.most_ms)) {
        gl.Finish();
        double turns = (gl_now_ms() - start) / fmax(ctx->turns.most_ms, 1);
        double rays = w->rays * fmin(1 / fmax(turns, 1e-3), 2);
        w->rays = (uint32_t)fmax(fmin(rays, RAYS_PER_DISPATCH), RAYS_ON_SOFTWARE / 4.0);
    }
    bool ok = pass_turn_inside(ctx, error);
    if (turn != ctx->turns.number)
        bind(w);
    return ok;
}

static uint32_t groups(uint32_t items, uint32_t size)
{
    return (items + size - 1) / size;
}

static void fill_block(const struct work *w, struct ray_block *b)
{
    const struct pen_trace_light *l = &w->light;
    const struct trace_points *p = &w->points;
    bool point = l->type == PEN_TRACE_POINT;
    float half[2] = {l->half[0], l->half[l->type == PEN_TRACE_RECT]};
    uint32_t seed = w->job->seed;
    *b = (struct ray_block){.net = {trace_hash(seed), p->low_bits, p->samples},
        .pretest = {trace_hash(~seed), p->pretest_low_bits},
        .size = {w->run->width, w->run->height, w->scene->node_count}};
    for (int c = 0; c < 3; c++) {
        b->origin[c] = l->origin[c];
        b->a[c] = point ? 0 : half[0] * l->x[c];
        b->b[c] = point ? 0 : half[1] * l->y[c];
        b->z[c] = l->z[c];
        b->mean[c] = w->run->face->textured ? w->run->face->emission_mean[c] : 1;
        b->eye[c] = w->run->view->eye[c];
    }
    b->origin[3] = l->cos_cone;
    b->eye[3] = RAY_DEPTH_ERROR;
    b->bias[0] = 0x1p-20f * w->scene->extent; /* rounding of coordinates, as on the CPU */
    b->bias[1] = w->job->target_error;
    b->bias[2] = ray_aim_error(w->run);
}

static void fill_buffer(GLuint *name, GLsizeiptr bytes, const void *data)
{
    if (!*name)
        gl.CreateBuffers(1, name);
    gl.NamedBufferData(*name, bytes, data, GL_STREAM_DRAW);
}

static bool upload_points(struct work *w, struct pen_error *error)
{
    const struct trace_points *p = &w->points;
    int32_t(*pairs)[2] = malloc(p->total * sizeof *pairs);
    if (!pairs)
        return pen_fail(error, PEN_UNAVAILABLE, "", "Out of memory.");
    for (uint32_t i = 0; i < p->total; i++) {
        pairs[i][0] = p->u[i];
        pairs[i][1] = p->v[i];
    }
    fill_buffer(&w->targets->points, (GLsizeiptr)(p->total * sizeof *pairs), pairs);
    free(pairs);
    return true;
}

static bool prepare(struct work *w, struct pen_error *error)
{
    struct ray_targets *t = w->targets;
    uint32_t width = w->run->width, height = w->run->height;
    struct ray_block block;
    bool round = w->light.type != PEN_TRACE_RECT;
    if (!trace_points_make(&w->points, w->samples, round, w->job->seed, error) ||
        !upload_points(w, error))
        return false;
    gl_target_fit(&t->visibility, GL_RGBA32F, width, height, 0, 1);
    gl_target_fit(&t->standard_error, GL_R32F, width, height, 0, 1);
    gl_target_fit(&t->verdicts, GL_R8UI, width, height, 0, 1);
    gl_target_fit(&t->spread, GL_R8UI, width, height, 0, 1);
    fill_block(w, &block);
    fill_buffer(&t->job, sizeof block, &block);
    fill_buffer(&t->list, (GLsizeiptr)4 * width * height, NULL);
    fill_buffer(&t->counters, sizeof(struct ray_counters), &(struct ray_counters){0});
    return true;
}

static void bind_image(GLuint unit, const struct gl_texture *texture)
{
    gl.BindImageTexture(unit, texture->name, 0, GL_FALSE, 0, GL_WRITE_ONLY, texture->format);
}

static void bind(const struct work *w)
{
    const struct ray_targets *t = w->targets;
    ray_scene_bind(w->scene);
    gl.BindBufferBase(GL_UNIFORM_BUFFER, UBO_EXTRA, t->job);
    gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, STORAGE_RAY_POINTS, t->points);
    gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, STORAGE_RAY_STATE, t->state);
    gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, STORAGE_RAY_LIST, t->list);
    gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, STORAGE_RAY_COUNTERS, t->counters);
    bind_image(IMAGE_VISIBILITY, &t->visibility.texture);
    bind_image(IMAGE_ERROR, &t->standard_error.texture);
    if (w->marked)
        bind_image(IMAGE_MARKS, &w->marked->texture);
    gl.BindTextureUnit(UNIT_RAY_POSITION, t->receivers[0].texture.name);
    gl.BindTextureUnit(UNIT_RAY_NORMAL, t->receivers[1].texture.name);
    gl.BindTextureUnit(UNIT_RAY_VERDICTS, t->verdicts.texture.name);
    gl.BindTextureUnit(UNIT_RAY_SPREAD, t->spread.texture.name);
    gl.BindTextureUnit(UNIT_EMISSION, w->run->emission->name);
    for (GLuint unit = UNIT_RAY_POSITION; unit < UNIT_RAY_END; unit++)
        gl.BindSampler(unit, 0);
    gl.BindSampler(UNIT_EMISSION, w->run->ctx->samplers.names[GL_SAMPLE_LINEAR]);
}

static void unbind(void)
{
    for (GLuint unit = UNIT_RAY_POSITION; unit < UNIT_RAY_END; unit++)
        gl.BindTextureUnit(unit, 0);
    gl.BindSampler(UNIT_EMISSION, 0);
}

static void mark(struct work *w, const struct gl_target *target)
{
    w->marked = target;
    bind_image(IMAGE_MARKS, &target->texture);
}

/* A few rays for all, in bands of rows. */
static bool pretest(struct work *w, struct pen_error *error)
{
    uint32_t height = w->run->height, columns = groups(w->run->width, RAY_TILE);
    uint32_t row_rays = columns * RAY_TILE * RAY_TILE * (TRACE_PRETEST_NET + TRACE_PRETEST_RIM);
    GLuint name = program(w, "ray_pretest.comp", error);
    if (!name)
        return false;
    mark(w, &w->targets->verdicts);
    for (uint32_t y = 0, rows; y < height; y += rows * RAY_TILE) {
        uint32_t left = groups(height - y, RAY_TILE);
        rows = row_rays < w->rays ? w->rays / row_rays : 1;
        gl.ProgramUniform1ui(name, LOCATION_FIRST_ROW, y);
        if (!dispatch(w, name, columns, left < rows ? left : rows, error))
            return false;
    }
    if (!(name = program(w, "ray_spread.comp", error)))
        return false;
    mark(w, &w->targets->spread);
    return dispatch(w, name, columns, groups(height, RAY_TILE), error);
}

static struct ray_counters read_counters(const struct work *w)
{
    struct ray_counters counters;
    gl.GetNamedBufferSubData(w->targets->counters, 0, sizeof counters, &counters);
    return counters;
}

/* Lists who gets all samples; settles the others. */
static bool select_receivers(struct work *w, struct pen_error *error)
{
    GLuint name = program(w, "ray_select.comp", error);
    if (!name || !dispatch(w, name, groups(w->run->width, RAY_TILE),
                     groups(w->run->height, RAY_TILE), error))
        return false;
    w->listed = read_counters(w).list_count;
    return true;
}

/* Points [point, end) of block b for `count` receivers from `first` on, whose sums begin at `state`;
 * slice by slice of whole pairs and at most `most` points. */
static bool sample_block(struct work *w, GLuint name, uint32_t b, const uint32_t range[4],
    uint32_t state, uint32_t most, struct pen_error *error)
{
    uint32_t end = range[2] + range[3], step = 2;
    bool may_stop = w->job->target_error > 0 && end >= TRACE_STOP_AFTER;
    while (step * 2 <= most && step * 2 <= w->rays / range[1])
        step *= 2;
    for (uint32_t point = range[2]; point < end; point += step) {
        uint32_t points = end - point < step ? end - point : step;
        bool last = point + points == end;
        gl.ProgramUniform4ui(name, LOCATION_RANGE, range[0], range[1], point, points);
        gl.ProgramUniform1ui(name, LOCATION_STATE, state);
        gl.ProgramUniform1ui(name, LOCATION_ENDS,
            last && b + 1 == w->points.block_count ? RAY_ENDS
            : last && may_stop                     ? RAY_MAY_END
                                                   : RAY_GOES_ON);
        if (!dispatch(w, name, groups(range[1], RAY_GROUP), 1, error))
            return false;
    }
    return true;
}

/* What all have so far becomes the result; those that are not done stay so. */
static bool estimate(struct work *w, GLuint name, uint32_t taken, struct pen_error *error)
{
    for (uint32_t first = 0, count; first < w->listed; first += count) {
        count = w->listed - first;
        count = count < RECEIVERS_PER_DISPATCH ? count : RECEIVERS_PER_DISPATCH;
        gl.ProgramUniform4ui(name, LOCATION_RANGE, first, count, taken, 0);
        gl.ProgramUniform1ui(name, LOCATION_STATE, first);
        gl.ProgramUniform1ui(name, LOCATION_ENDS, RAY_IS_SEEN);
        if (!dispatch(w, name, groups(count, RAY_GROUP), 1, error))
            return false;
    }
    return true;
}

static bool is_cut(const struct work *w)
{
    return read_counters(w).cut != 0;
}

/* All receivers have had so many samples. */
static bool look_up(struct work *w, GLuint name, uint32_t taken, struct pen_error *error)
{
    struct technique_run *run = w->run;
    enum technique_step step = pass_step(run, taken, w->samples);
    if (step == STEP_GO_ON)
        return true;
    w->cut_short = is_cut(w);
    if (w->cut_short)
        return true;
    w->enough = step == STEP_STOP;
    if (!estimate(w, name, taken, error))
        return false;
    if (w->enough)
        return true;
    gl_timer_end(&run->ctx->timer);
    unbind();
    bool ok = w->job->settle(run, error) && pass_show(run, error);
    bind(w);
    gl_timer_begin(&run->ctx->timer, PEN_STAGE_TECHNIQUE, "ray samples");
    return ok;
}

/* How many receivers come next; each takes a few points at a time. */
static uint32_t slice(const struct work *w, uint32_t first)
{
    uint32_t count = w->rays / POINTS_ON_SOFTWARE, left = w->listed - first;
    count = count < RECEIVERS_PER_DISPATCH ? count : RECEIVERS_PER_DISPATCH;
    count = count > RAY_GROUP ? count : RAY_GROUP;
    return count < left ? count : left;
}

/* Block by block, for all of the list. */
static bool sample_in_steps(struct work *w, GLuint name, uint32_t most, struct pen_error *error)
{
    const struct trace_points *p = &w->points;
    uint32_t point = 0;
    for (uint32_t b = 0; b < p->block_count && !w->enough && !w->cut_short; b++) {
        for (uint32_t first = 0, count; first < w->listed; first += count) {
            count = slice(w, first);
            const uint32_t range[4] = {first, count, point, p->blocks[b].count};
            if (!sample_block(w, name, b, range, first, most, error))
                return false;
        }
        point += p->blocks[b].count;
        if (b + 1 < p->block_count && !look_up(w, name, point, error))
            return false;
    }
    return true;
}

/* A part of the list after the other, each with all of its blocks. */
static bool sample_in_parts(struct work *w, GLuint name, uint32_t most, struct pen_error *error)
{
    const struct trace_points *p = &w->points;
    for (uint32_t first = 0, count; first < w->listed; first += count) {
        count = slice(w, first);
        for (uint32_t b = 0, point = 0; b < p->block_count; point += p->blocks[b++].count) {
            const uint32_t range[4] = {first, count, point, p->blocks[b].count};
            if (!sample_block(w, name, b, range, 0, most, error))
                return false;
        }
    }
    return true;
}

static bool sample(struct work *w, struct pen_error *error)
{
    GLuint name = program(w, "ray_samples.comp", error);
    if (!name)
        return false;
    w->in_steps = w->run->watch && w->points.block_count > 1 && w->listed <= RECEIVERS_IN_STEPS;
    uint32_t kept =
        w->in_steps && w->listed > RECEIVERS_PER_DISPATCH ? w->listed : RECEIVERS_PER_DISPATCH;
    fill_buffer(&w->targets->state, (GLsizeiptr)sizeof(struct ray_sums) * kept, NULL);
    bind(w);
    uint32_t most = w->run->ctx->software ? POINTS_ON_SOFTWARE : POINTS_PER_DISPATCH;
    for (; most >= 2; most /= 2) {
        static const uint32_t zero;
        gl.NamedBufferSubData(
            w->targets->counters, offsetof(struct ray_counters, cut), sizeof zero, &zero);
        w->cut_short = w->enough = false;
        if (!(w->in_steps ? sample_in_steps : sample_in_parts)(w, name, most, error))
            return false;
        if (w->enough || !is_cut(w))
            return true;
    }
    return pen_fail(
        error, PEN_TOO_BIG, "/scene", "This device cuts short what it takes to trace the scene.");
}

static void add_counts(const struct work *w)
{
    struct ray_counters counters = read_counters(w);
    w->run->result->rays += (uint64_t)counters.rays_high << 32 | counters.rays_low;
    w->run->result->full_work_pixels += counters.full_pixels;
}

static const struct step {
    const char *name;
    bool (*run)(struct work *, struct pen_error *);
} steps[] = {{"ray pre-test", pretest}, {"ray select", select_receivers}, {"ray samples", sample}};

static bool run_step(struct work *w, const struct step *step, struct pen_error *error)
{
    gl_timer_begin(&w->run->ctx->timer, PEN_STAGE_TECHNIQUE, step->name);
    bool ok = step->run(w, error);
    gl_timer_end(&w->run->ctx->timer);
    return ok;
}

bool pass_rays_device(struct technique_run *run, const struct ray_job *job,
    struct ray_targets *targets, struct pen_error *error)
{
    struct work w = {.run = run, .job = job, .targets = targets, .light = ray_light(run)};
    w.scene = ray_scene_get(run, error);
    if (!w.scene || !ray_receivers(run, targets, error))
        return false;
    w.samples = w.light.type == PEN_TRACE_POINT ? 1 : trace_points_round(job->samples);
    w.pretest = job->adaptive && w.samples > TRACE_PRETEST_NET + TRACE_PRETEST_RIM;
    make_defines(&w);
    bool ok = prepare(&w, error);
    if (ok) {
        bind(&w);
        w.rays = run->ctx->software ? RAYS_ON_SOFTWARE : RAYS_PER_DISPATCH;
        for (size_t i = w.pretest ? 0 : 1; ok && i < sizeof steps / sizeof *steps; i++)
            ok = run_step(&w, &steps[i], error);
        unbind();
    }
    if (ok)
        add_counts(&w);
    trace_points_finish(&w.points);
    return ok;
}
