#include "renderer/passes/passes.h"
#include "renderer/trace/trace.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

static const char *const weighting_names[] = {"area", "g", NULL};

/* Errors of several lights must not be alike, or they would not average out. */
#define LIGHT_SEED 0x9e3779b9u

struct raytraced {
    uint32_t samples;
    uint32_t weighting;
    pen_flag adaptive;
    float target_error;
    uint32_t seed;
};

static const struct pen_param rows[] = {
    PARAM(struct raytraced, samples, .def = 256, .min = 1, .max = 65536,
        .help = "Shadow rays per pixel at most, rounded up to a power of two."),
    PARAM(struct raytraced, weighting, .choices = weighting_names, .specialise = 1,
        .help = "Mean over the light's area, or weighted by each point's irradiance."),
    PARAM(struct raytraced, adaptive, .def = 1,
        .help = "Spends all rays only near pixels whose first 16 disagree."),
    PARAM(struct raytraced, target_error, .def = 0, .min = 0, .max = 0.5,
        .help = "Stops when a pixel's standard error is below; 0 spends all rays."),
    PARAM(struct raytraced, seed, .def = 0, .min = 0, .max = 16777215,
        .help = "Another number gives another, equally good set of rays."),
};

struct state {
    struct gl_texture receivers[2]; /* world position, geometric normal */
    GLuint receivers_framebuffer;
    struct gl_texture visibility;     /* RGBA32F */
    struct gl_texture standard_error; /* R32F, of visibility's a; only when the frame wants it */
};

static void destroy(struct technique_ctx *ctx, void *state)
{
    struct state *s = state;
    (void)ctx;
    gl_texture_destroy(&s->receivers[0]);
    gl_texture_destroy(&s->receivers[1]);
    gl_texture_destroy(&s->visibility);
    gl_texture_destroy(&s->standard_error);
    gl.DeleteFramebuffers(1, &s->receivers_framebuffer);
}

static void free_trace(void *trace)
{
    pen_trace_scene_destroy(trace);
}

static struct pen_trace_scene *trace_scene(struct scene *scene, struct pen_error *error)
{
    if (!scene->trace) {
        scene->trace = pen_trace_scene_create(&scene->blob, NULL, error);
        scene->trace_free = free_trace;
    }
    return scene->trace;
}

static struct pen_trace_light trace_light(const struct light *light)
{
    static const uint32_t types[PEN_LIGHT_TYPES] = {[PEN_LIGHT_RECT] = PEN_TRACE_RECT,
        [PEN_LIGHT_DISK] = PEN_TRACE_DISK,
        [PEN_LIGHT_SPHERE] = PEN_TRACE_SPHERE,
        [PEN_LIGHT_SUN] = PEN_TRACE_SUN,
        [PEN_LIGHT_POINT] = PEN_TRACE_POINT,
        [PEN_LIGHT_SPOT] = PEN_TRACE_POINT};
    struct pen_trace_light t = {.type = types[light->source->type], .cos_cone = -1};
    memcpy(t.origin, light->origin, sizeof t.origin);
    memcpy(t.x, light->x, sizeof t.x);
    memcpy(t.y, light->y, sizeof t.y);
    memcpy(t.z, light->z, sizeof t.z);
    memcpy(t.half, light->faces[0].half, sizeof t.half);
    return t;
}

/* The emission texture as floats; freed by the caller. */
static float *read_emission(const struct technique_run *run, struct pen_trace_light *light)
{
    if (!run->face->textured)
        return NULL;
    size_t bytes = (size_t)run->emission->width * run->emission->height * 16;
    float *texels = malloc(bytes);
    if (!texels)
        abort();
    gl.GetTextureImage(run->emission->name, 0, GL_RGBA, GL_FLOAT, (GLsizei)bytes, texels);
    light->emission = texels;
    light->columns = run->emission->width, light->rows = run->emission->height;
    light->bilinear = true;
    return texels;
}

/* World positions and geometric normals of the receivers, out of the G-buffer. */
static bool read_receivers(
    struct technique_run *run, float *positions, float *normals, struct pen_error *error)
{
    struct state *s = run->state;
    bool made = gl_texture_fit(&s->receivers[0], GL_RGBA32F, run->width, run->height, 0, 1);
    made |= gl_texture_fit(&s->receivers[1], GL_RGBA32F, run->width, run->height, 0, 1);
    if (made || !s->receivers_framebuffer) {
        gl.DeleteFramebuffers(1, &s->receivers_framebuffer);
        const struct gl_texture *colors[] = {&s->receivers[0], &s->receivers[1]};
        s->receivers_framebuffer = gl_framebuffer_create(colors, 2, NULL);
    }
    struct pass_texture textures[] = {{UNIT_DEPTH, run->gbuffer->depth.name, GL_SAMPLE_NEAREST},
        {UNIT_NORMAL, run->gbuffer->normal.name, GL_SAMPLE_NEAREST}};
    if (!pass_fill(run->ctx,
            &(struct pass_fill){.name = "receivers",
                .fragment = "receivers.frag",
                .stage = PEN_STAGE_TECHNIQUE,
                .textures = textures,
                .texture_count = 2,
                .framebuffer = s->receivers_framebuffer,
                .width = run->width,
                .height = run->height},
            error))
        return false;
    GLsizei bytes = (GLsizei)(16 * run->width * run->height);
    gl.PixelStorei(GL_PACK_ALIGNMENT, 1);
    gl.GetTextureImage(s->receivers[0].name, 0, GL_RGBA, GL_FLOAT, bytes, positions);
    gl.GetTextureImage(s->receivers[1].name, 0, GL_RGBA, GL_FLOAT, bytes, normals);
    return true;
}

static bool trace(struct technique_run *run, struct pen_error *error)
{
    const struct raytraced *params = run->params;
    struct state *s = run->state;
    struct pen_trace_scene *scene = trace_scene(run->scene, error);
    if (!scene)
        return false;
    size_t count = (size_t)run->width * run->height;
    float *positions = malloc(16 * count), *normals = malloc(16 * count);
    float *visibility = malloc(16 * count), *standard_error = malloc(4 * count);
    if (!positions || !normals || !visibility || !standard_error)
        abort();
    struct pen_trace_light light = trace_light(run->light);
    float *emission = read_emission(run, &light);
    struct pen_trace_job job = {.positions = positions,
        .normals = normals,
        .position_stride = 4,
        .normal_stride = 4,
        .width = run->width,
        .height = run->height,
        .samples = params->samples,
        .target_error = params->target_error,
        .weighting = params->weighting,
        .adaptive = params->adaptive.on && run->face->half[0] > 0,
        .depth_error = 0x1p-16f,
        .seed = params->seed + run->frame + LIGHT_SEED * run->light_index};
    memcpy(job.eye, run->view->eye, sizeof job.eye);
    bool wants_error = run->variance_framebuffer != 0;
    struct pen_trace_result result = {
        .visibility = visibility, .standard_error = wants_error ? standard_error : NULL};
    struct pen_trace_stats stats;
    bool ok = read_receivers(run, positions, normals, error);
    gl_timer_begin(&run->ctx->timer, PEN_STAGE_TECHNIQUE, "trace");
    ok = ok && pen_trace_visibility(scene, &light, &job, &result, &stats, error);
    gl_timer_end(&run->ctx->timer);
    if (ok) {
        gl_texture_fit(&s->visibility, GL_RGBA32F, run->width, run->height, 0, 1);
        gl.TextureSubImage2D(s->visibility.name, 0, 0, 0, (GLsizei)run->width, (GLsizei)run->height,
            GL_RGBA, GL_FLOAT, visibility);
        gl_texture_fit(&s->standard_error, GL_R32F, run->width, run->height, 0, 1);
        if (wants_error)
            gl.TextureSubImage2D(s->standard_error.name, 0, 0, 0, (GLsizei)run->width,
                (GLsizei)run->height, GL_RED, GL_FLOAT, standard_error);
        run->result->rays += stats.rays;
        run->result->full_work_pixels += (uint32_t)stats.full_receivers;
    }
    free(positions);
    free(normals);
    free(visibility);
    free(standard_error);
    free(emission);
    return ok;
}

static bool record(struct technique_run *run, struct pen_error *error)
{
    struct state *s = run->state;
    /* A light is traced once; each face then takes its own receivers. */
    if (run->face == &run->light->faces[0] && !trace(run, error))
        return false;
    run->work_counted = true;
    struct pass_texture traced[] = {{UNIT_FREE, s->visibility.name, GL_SAMPLE_NEAREST},
        {UNIT_FREE + 1, s->standard_error.name, GL_SAMPLE_NEAREST}};
    struct pass_screen resolve = {
        .name = "trace resolve", .body = "raytraced.glsl", .textures = traced, .texture_count = 2};
    if (!pass_screen(run, &resolve, error) || !run->variance_framebuffer)
        return run->variance_framebuffer == 0;
    resolve.name = "trace variance";
    resolve.defines = "#define VARIANCE\n";
    resolve.framebuffer = run->variance_framebuffer;
    resolve.add = true;
    return pass_screen(run, &resolve, error);
}

const struct technique technique_raytraced = {
    .info = {.name = "raytraced",
        .title = "Ray-traced area light",
        .summary =
            "Shadow rays from every pixel to points of the light: the reference, independent "
            "of any shadow map.",
        .citation = "R. Cook, T. Porter, L. Carpenter, Distributed ray tracing, SIGGRAPH 1984; "
                    "I. Wald et al., Embree, SIGGRAPH 2014",
        .artefacts = "Fine noise at few samples; facets of coarse meshes shadow themselves at the "
                     "terminator.",
        .cost_class = PEN_COST_REFERENCE,
        .textured = true,
        .struct_size = sizeof(struct raytraced),
        .params = {rows, sizeof rows / sizeof *rows}},
    .state_size = sizeof(struct state),
    .estimates_error = true,
    .record = record,
    .destroy = destroy,
};
