#include "renderer/frame/blended.h"
#include "renderer/frame/edges.h"
#include "renderer/frame/needs.h"
#include "renderer/passes/draw/screen.h"

const struct gbuffer *frame_data_gbuffer(const struct frame_job *job)
{
    return frame_is_layered(job) ? &job->targets->layer : &job->targets->gbuffer;
}

void frame_blended_fit(const struct frame_job *job)
{
    struct frame_targets *t = job->targets;
    uint32_t width = job->request->width, height = job->request->height;
    gl_target_fit(&t->layer_before, GL_DEPTH_COMPONENT32F, width, height, 0, 1);
    gl_target_fit(&t->front_depth, GL_DEPTH_COMPONENT32F, width, height, 0, 1);
    if (frame_edges_are_smooth(job))
        gl_target_fit(&t->front_normal, GL_RGBA16, width, height, 0, 1);
    gl_target_fit(&t->layers, GL_RGBA32F, width, height, 0, 1);
}

static void clear_depth(const struct gl_target *target, float depth)
{
    gl.DepthMask(GL_TRUE);
    gl.ClearNamedFramebufferfv(target->framebuffer, GL_DEPTH, 0, &depth);
}

void frame_blended_begin(const struct frame_job *job)
{
    static const float zero[4] = {0};
    struct frame_targets *t = job->targets;
    clear_depth(&t->layer_before, 1);
    clear_depth(&t->front_depth, 0);
    gl_target_clear(&t->layers, zero);
}

struct gbuffer_pass frame_blended_pass(const struct frame_job *job, uint32_t number)
{
    const struct frame_targets *t = job->targets;
    return (struct gbuffer_pass){.kind = GBUFFER_LAYER,
        .before = number == 1 ? &t->front_depth.texture : &t->layer_before.texture,
        .solid = &t->gbuffer.depth.texture,
        .last = number == BLENDED_LAYERS - 1};
}

static void copy(const struct gl_target *from, const struct gl_target *to)
{
    gl.CopyImageSubData(from->texture.name, GL_TEXTURE_2D, 0, 0, 0, 0, to->texture.name,
        GL_TEXTURE_2D, 0, 0, 0, 0, (GLsizei)from->texture.width, (GLsizei)from->texture.height, 1);
}

void frame_blended_next(const struct frame_job *job, uint32_t number)
{
    struct frame_targets *t = job->targets;
    copy(&t->layer.depth, number ? &t->layer_before : &t->front_depth);
    if (!number && frame_edges_are_smooth(job))
        copy(&t->layer.normal, &t->front_normal);
}

void frame_blended_keep(const struct frame_job *job)
{
    struct frame_targets *t = job->targets;
    const struct gl_texture *sum = &t->layers.texture;
    gl_target_fit(&t->layers_kept, sum->format, sum->width, sum->height, 0, 1);
    copy(&t->layers, &t->layers_kept);
}

void frame_blended_restore(const struct frame_job *job)
{
    copy(&job->targets->layers_kept, &job->targets->layers);
}

bool frame_blended_end(const struct frame_job *job, struct pen_error *error)
{
    const struct frame_targets *t = job->targets;
    struct pass_texture sum = {UNIT_SOURCE, t->layers.texture.name, GL_SAMPLE_NEAREST};
    return pass_fill(job->ctx,
        &(struct pass_fill){.name = "layers",
            .fragment = "layers.frag",
            .stage = PEN_STAGE_SHADE,
            .textures = &sum,
            .texture_count = 1,
            .framebuffer = t->beauty.framebuffer,
            .width = job->request->width,
            .height = job->request->height,
            .add = true},
        error);
}
