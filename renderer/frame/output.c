#include "renderer/frame/output.h"
#include "renderer/frame/blended.h"
#include "renderer/frame/edges.h"
#include "protocol/memory.h"
#include "renderer/frame/layers.h"
#include "renderer/frame/needs.h"
#include "renderer/passes/draw/pieces.h"
#include "renderer/passes/draw/screen.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define SHARED_ROWS "renderer/shaders/frame/view.def"
#include "renderer/shared/rows_c.h"

static enum pen_pixel pixel_of(const struct pen_output *output, uint32_t layer)
{
    /* Half floats would cut metres to three digits. */
    bool wide =
        output->bit_depth == 32 || (!output->bit_depth && pen_layer_is_metres(&pen_layers[layer]));
    if (output->format == PEN_EXR)
        return wide ? PEN_PIXEL_RGBA32F : PEN_PIXEL_RGBA16F;
    return output->bit_depth == 16 ? PEN_PIXEL_RGBA32F : PEN_PIXEL_RGBA8;
}

static bool is_direct(const struct pen_request *r, bool layered)
{
    return r->output.layer == PEN_LAYER_BEAUTY && r->antialias == 1 && !layered &&
           !pen_request_is_transparent(r) && /* alpha is rounded once */
           pixel_of(&r->output, PEN_LAYER_BEAUTY) == PEN_PIXEL_RGBA8;
}

bool frame_output_is_direct(const struct frame_job *job)
{
    return is_direct(job->request, frame_is_layered(job));
}

static const GLenum internal_formats[] = {GL_RGBA8, GL_RGBA16F, GL_RGBA32F};
static const GLenum read_types[] = {GL_UNSIGNED_BYTE, GL_HALF_FLOAT, GL_FLOAT};
static const size_t pixel_bytes[] = {4, 8, 16};

static void fit_color(struct frame_targets *t, const struct pen_request *r, enum pen_pixel pixel)
{
    gl_target_fit(&t->color, internal_formats[pixel], r->width, r->height, 0, 1);
}

void frame_output_fit(struct frame_targets *t, const struct pen_request *r)
{
    fit_color(t, r, pixel_of(&r->output, r->output.layer));
}

#define SHARED_ROWS "renderer/shaders/frame/output.def"
#include "renderer/shared/rows_c.h"

static void make_block(
    const struct frame_job *job, const struct view *view, uint32_t frames, struct output_block *b)
{
    float center[3], radius = scene_radius(job->scene), distance = 0;
    scene_center(job->scene, center);
    const struct psc_header *h = job->scene->blob.header;
    bool empty = scene_is_empty(job->scene);
    b->shadings[0] = (float)(job->request->light_count * frames);
    b->shadings[1] = (float)job->request->antialias / (float)frames;
    for (int i = 0; i < 3; i++) {
        b->bounds_min[i] = empty ? -1 : h->bounds_min[i];
        b->bounds_max[i] = empty ? 1 : h->bounds_max[i];
        b->origin[i] = (float)h->origin[i];
        distance += (center[i] - view->eye[i]) * view->forward[i];
    }
    b->bounds_min[3] = fmaxf(distance - radius, 0);
    b->bounds_max[3] =
        distance + radius > b->bounds_min[3] ? distance + radius : b->bounds_min[3] + radius;
}

static const struct gl_texture *source_of(const struct frame_targets *t, uint32_t layer)
{
    static const struct gl_texture none;
    switch (pen_layers[layer].source) {
    case PEN_SOURCE_BEAUTY:
        return &t->beauty.texture;
    case PEN_SOURCE_VISIBILITY:
        return &t->visibility.texture;
    case PEN_SOURCE_CLASSES:
        return &t->classes.texture;
    case PEN_SOURCE_VARIANCE:
        return &t->variance.texture;
    default:
        return &none;
    }
}

static bool convert(const struct frame_job *job, const struct output_block *block, uint32_t layer,
    bool raw, struct pen_error *error)
{
    struct frame_targets *t = job->targets;
    const struct gbuffer *g = frame_data_gbuffer(job);
    char defines[64];
    snprintf(defines, sizeof defines, "#define LAYER layer_%s\n%s", pen_layers[layer].name,
        raw ? "#define RAW true\n" : "#define RAW false\n");
    struct pass_texture textures[] = {{UNIT_DEPTH, g->depth.texture.name, GL_SAMPLE_NEAREST},
        {UNIT_NORMAL, g->normal.texture.name, GL_SAMPLE_NEAREST},
        {UNIT_ALBEDO, g->albedo.texture.name, GL_SAMPLE_NEAREST},
        {UNIT_SURFACE, g->surface.texture.name, GL_SAMPLE_NEAREST},
        {UNIT_SOURCE, source_of(t, layer)->name, GL_SAMPLE_NEAREST}};
    return pass_fill(job->ctx,
        &(struct pass_fill){.name = "output",
            .fragment = "output.frag",
            .defines = defines,
            .stage = PEN_STAGE_SHADE,
            .textures = textures,
            .texture_count = sizeof textures / sizeof *textures,
            .framebuffer = t->color.framebuffer,
            .width = job->request->width,
            .height = job->request->height,
            .extra = block,
            .extra_bytes = sizeof *block},
        error);
}

static uint32_t channels_of(const struct pen_request *r, uint32_t layer, enum pen_pixel pixel)
{
    if (layer == PEN_LAYER_BEAUTY && pen_request_is_transparent(r))
        return 4;
    switch (pen_layers[layer].channels) {
    case PEN_CHANNELS_Y:
    case PEN_CHANNELS_Z:
        return 1;
    case PEN_CHANNELS_RGBA:
        return pixel == PEN_PIXEL_RGBA8 ? 3 : 4;
    default:
        return 3;
    }
}

static void read_plane(
    const struct frame_job *job, enum pen_pixel pixel, uint32_t layer, struct pen_frame *frame)
{
    struct pen_plane *plane = &frame->planes[frame->plane_count++];
    snprintf(plane->name, sizeof plane->name, "%s", pen_layers[layer].name);
    plane->pixel = pixel;
    plane->channels = channels_of(job->request, layer, pixel);
    plane->data = pen_alloc((size_t)frame->width * frame->height * pixel_bytes[pixel], 1);
    gl_timer_begin(&job->ctx->timer, PEN_STAGE_READBACK, "readback");
    gl.BindFramebuffer(GL_FRAMEBUFFER, job->targets->color.framebuffer);
    gl.PixelStorei(GL_PACK_ALIGNMENT, 1);
    gl.ReadPixels(0, 0, (GLsizei)frame->width, (GLsizei)frame->height, GL_RGBA, read_types[pixel],
        plane->data);
    gl_timer_end(&job->ctx->timer);
}

/* To whole codes, as OpenGL rounds them. */
static void narrow(struct pen_plane *plane, size_t pixels)
{
    float *from = plane->data;
    uint8_t *to = plane->data;
    for (size_t i = 0; i < 4 * pixels; i++)
        to[i] = (uint8_t)(255 * fmaxf(fminf(from[i], 1), 0) + 0.5f);
    plane->data = pen_realloc_array(plane->data, pixels, 4);
    plane->pixel = PEN_PIXEL_RGBA8;
}

bool frame_output_read(const struct frame_job *job, const struct view *view, uint32_t frames,
    struct pen_frame *frame, struct pen_error *error)
{
    const struct pen_request *r = job->request;
    bool raw = r->output.format == PEN_EXR;
    struct output_block block = {0};
    memset(frame, 0, sizeof *frame);
    frame->width = r->width, frame->height = r->height;
    make_block(job, view, frames, &block);
    for (uint32_t layer = 0; layer < PEN_LAYER_ALL; layer++) {
        bool has = pen_layers[layer].source != PEN_SOURCE_VARIANCE ||
                   frame_layers_want_error(r, job->technique);
        if (r->output.layer == PEN_LAYER_ALL ? !has : r->output.layer != layer)
            continue;
        enum pen_pixel pixel = pixel_of(&r->output, layer);
        bool direct = frame_output_is_direct(job);
        bool smooth = pen_layers[layer].source == PEN_SOURCE_BEAUTY && frame_edges_are_smooth(job);
        bool drawn = smooth && frame_edges_are_drawn(job);
        /* Alpha is rounded once. */
        bool narrowed = smooth && !drawn && !direct && pixel == PEN_PIXEL_RGBA8;
        if (narrowed)
            pixel = PEN_PIXEL_RGBA32F;
        if (!direct)
            fit_color(job->targets, r, pixel);
        if (drawn     ? !frame_edges_blend(job, view, direct, raw, error)
            : !direct ? !convert(job, &block, layer, raw, error)
                      : false)
            goto fail;
        read_plane(job, pixel, layer, frame);
        struct pen_plane *plane = &frame->planes[frame->plane_count - 1];
        if (smooth && !drawn && !frame_edges_smooth(job, view, raw, plane, error))
            goto fail;
        if (narrowed) {
            narrow(plane, (size_t)r->width * r->height);
            plane->channels = channels_of(r, layer, PEN_PIXEL_RGBA8);
        }
    }
    return true;
fail:
    pen_frame_finish(frame);
    return false;
}

/* Bytes per pixel: the G-buffer without emission; what blended layers have besides; what most methods
 * have of their own at some time. */
#define GBUFFER_BYTES 20
#define LAYER_BYTES 56
#define METHOD_BYTES 16

uint64_t frame_output_estimate(const struct pen_request *r, uint32_t lights, bool blended)
{
    bool layered = blended && frame_needs(r, PEN_SOURCE_BEAUTY), direct = is_direct(r, layered);
    uint64_t bytes = GBUFFER_BYTES + METHOD_BYTES + 8ull * (lights ? lights : 1) +
                     (r->output.format == PEN_EXR || r->output.bit_depth == 16 ? 16 : 4) +
                     (direct ? 4 : 0);
    bytes += !direct && frame_needs(r, PEN_SOURCE_BEAUTY) ? 16 : 0;
    bytes += layered ? LAYER_BYTES : 0;
    bytes += frame_needs(r, PEN_SOURCE_VISIBILITY) ? 16 : 0;
    bytes += frame_needs(r, PEN_SOURCE_CLASSES) ? 4 : 0;
    bytes += frame_needs(r, PEN_SOURCE_VARIANCE) ? 4 : 0;
    return bytes * r->width * r->height;
}

bool frame_output_room(const struct frame_job *job, uint32_t lights, struct pen_error *error)
{
    const struct pen_request *r = job->request;
    const struct gl_texture *last = &job->targets->vis.texture;
    return (last->width == r->width && last->height == r->height) ||
           pass_room(job->ctx, frame_output_estimate(r, lights, frame_is_layered(job)), error);
}

void frame_output_aim(const struct frame_job *job, const struct view *v, uint32_t number)
{
    const struct pen_request *r = job->request;
    struct view_block b = {0};
    memcpy(b.world_to_clip, v->world_to_clip, sizeof b.world_to_clip);
    memcpy(b.clip_to_world, v->clip_to_world, sizeof b.clip_to_world);
    memcpy(b.eye, v->eye, 12);
    b.eye[3] = 0.5f * (float)r->height / tanf(0.5f * v->fov_y_rad);
    memcpy(b.forward, v->forward, 12);
    b.forward[3] = v->near_z;
    b.viewport[0] = (float)r->width, b.viewport[1] = (float)r->height;
    b.viewport[2] = 1 / b.viewport[0], b.viewport[3] = 1 / b.viewport[1];
    memcpy(b.ambient, r->ambient, 12);
    if (r->background[0] != PEN_AUTO && !pen_request_is_transparent(r))
        memcpy(b.background, r->background, 12);
    memcpy(b.ground_albedo, r->ground_albedo, 12);
    b.ground_albedo[3] = scene_ground_top(job->scene);
    scene_ground(job->scene, b.ground);
    b.display[0] = exp2f(r->exposure_ev);
    b.display[1] = (float)r->tone_map;
    b.display[2] = (float)number;
    b.display[3] = 1 / (float)r->antialias;
    gl.NamedBufferData(job->ctx->view_block, sizeof b, &b, GL_STREAM_DRAW);
    gl.BindBufferBase(GL_UNIFORM_BUFFER, UBO_VIEW, job->ctx->view_block);
}
