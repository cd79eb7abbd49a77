#include "renderer/frame/layers.h"
#include "renderer/frame/blended.h"
#include "renderer/frame/needs.h"
#include "renderer/passes/draw/screen.h"
#include "renderer/passes/draw/turn.h"
#include "renderer/passes/map/classify.h"

#define SHARED_ROWS "renderer/shaders/frame/average.def"
#include "renderer/shared/rows_c.h"
#define SHARED_ROWS "renderer/shaders/frame/classes.def"
#include "renderer/shared/rows_c.h"

bool frame_layers_want_classes(const struct pen_request *r)
{
    return frame_needs(r, PEN_SOURCE_CLASSES);
}

bool frame_layers_want_error(const struct pen_request *r, const struct technique *technique)
{
    return technique->estimates_error && frame_needs(r, PEN_SOURCE_VARIANCE);
}

void frame_layers_begin(const struct frame_job *job, struct pen_result *result)
{
    const struct pen_request *r = job->request;
    const char *title = job->technique->info.title;
    /* Half floats count to 2048 exactly; there are at most 8 lights in 64 frames. */
    if (frame_layers_want_classes(r))
        frame_fit_sum(&job->targets->classes, GL_RG16F, r);
    bool estimated = frame_layers_want_error(r, job->technique);
    bool alone = r->output.layer != PEN_LAYER_ALL && frame_needs(r, PEN_SOURCE_VARIANCE);
    if (estimated || alone)
        frame_fit_sum(&job->targets->variance, GL_R32F, r);
    if (!estimated && alone)
        pen_result_warn(result, "%s does not estimate its error: the layer is 0.", title);
}

bool frame_layers_add_visibility(
    const struct frame_job *job, uint32_t light_count, struct pen_error *error)
{
    struct average_block block = {.count = {(int32_t)light_count}};
    const struct frame_targets *t = job->targets;
    struct pass_texture textures[] = {{UNIT_SOURCE, t->vis.texture.name, GL_SAMPLE_NEAREST},
        {UNIT_DEPTH, frame_data_gbuffer(job)->depth.texture.name, GL_SAMPLE_NEAREST}};
    return pass_fill(job->ctx,
        &(struct pass_fill){.name = "average",
            .fragment = "average.frag",
            .stage = PEN_STAGE_SHADE,
            .textures = textures,
            .texture_count = 2,
            .framebuffer = t->visibility.framebuffer,
            .width = job->request->width,
            .height = job->request->height,
            .add = true,
            .extra = &block,
            .extra_bytes = sizeof block},
        error);
}

bool frame_layers_add_classes(const struct frame_job *job, const struct gl_texture *tiles,
    bool first, struct pen_error *error)
{
    struct pass_texture textures[] = {
        {UNIT_DEPTH, frame_data_gbuffer(job)->depth.texture.name, GL_SAMPLE_NEAREST},
        {UNIT_TILES, tiles ? tiles->name : 0, GL_SAMPLE_NEAREST}};
    struct classes_block block = {.tile = {CLASSIFY_TILE, first ? 1 : 0}};
    return pass_fill(job->ctx,
        &(struct pass_fill){.name = "classes",
            .fragment = "classes.frag",
            .defines = tiles ? "#define TILES\n" : NULL,
            .stage = PEN_STAGE_SHADE,
            .textures = textures,
            .texture_count = tiles ? 2 : 1,
            .framebuffer = job->targets->classes.framebuffer,
            .width = job->request->width,
            .height = job->request->height,
            .add = true,
            .extra = &block,
            .extra_bytes = sizeof block},
        error);
}

static bool count(const struct frame_job *job, const struct gbuffer *gbuffer, GLuint *query,
    struct pen_error *error)
{
    struct gl_program_desc desc = {.vertex = "screen.vert",
        .fragment = "constant.frag",
        .defines = "#define CONSTANT vec4(0.0)\n"};
    GLuint program = gl_programs_get(job->ctx->programs, &desc, error);
    if (!program)
        return false;
    gl_timer_begin(&job->ctx->timer, PEN_STAGE_GBUFFER, "count receivers");
    gl.CreateQueries(GL_SAMPLES_PASSED, 1, query);
    gl.BindFramebuffer(GL_FRAMEBUFFER, gbuffer->framebuffer);
    gl.Viewport(0, 0, (GLsizei)job->request->width, (GLsizei)job->request->height);
    gl.UseProgram(program);
    gl.BindVertexArray(job->ctx->empty_array);
    /* At depth 0, which is the background's: it passes where something is nearer. */
    gl.Enable(GL_DEPTH_TEST);
    gl.DepthFunc(GL_LESS);
    gl.DepthMask(GL_FALSE);
    gl.ColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
    gl.BeginQuery(GL_SAMPLES_PASSED, *query);
    gl.DrawArrays(GL_TRIANGLES, 0, 3);
    gl.EndQuery(GL_SAMPLES_PASSED);
    gl.ColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    gl.DepthMask(GL_TRUE);
    gl.Disable(GL_DEPTH_TEST);
    gl_timer_end(&job->ctx->timer);
    return pass_turn(job->ctx, error);
}

bool frame_layers_count_receivers(
    const struct frame_job *job, uint32_t number, struct frame_work *work, struct pen_error *error)
{
    return count(job, &job->targets->gbuffer, &work->queries[number], error);
}

bool frame_layers_count_now(const struct frame_job *job, const struct gbuffer *gbuffer,
    uint32_t *receivers, struct pen_error *error)
{
    GLuint query = 0;
    GLuint64 found = 0;
    bool ok = count(job, gbuffer, &query, error);
    if (ok)
        gl.GetQueryObjectui64v(query, GL_QUERY_RESULT, &found);
    gl.DeleteQueries(1, &query);
    *receivers = (uint32_t)found;
    return ok;
}

void frame_layers_end(const struct frame_job *job, const struct frame_work *work, bool classified,
    struct pen_result *result)
{
    const struct pen_request *r = job->request;
    for (uint32_t i = 0; i < PEN_MAX_ANTIALIAS; i++) {
        GLuint64 receivers = 0;
        if (!work->lights[i])
            continue;
        gl.GetQueryObjectui64v(work->queries[i], GL_QUERY_RESULT, &receivers);
        result->full_work_pixels += work->lights[i] * (uint32_t)receivers;
    }
    if (r->output.layer == PEN_LAYER_ALL || !frame_layers_want_classes(r) || classified)
        return;
    if (r->classify.on)
        pen_result_warn(result, "%s does not use the classifier here: all is undecided.",
            job->technique->info.title);
    else
        pen_result_warn(result, "Nothing was classified, as the request wants: all is undecided.");
}
