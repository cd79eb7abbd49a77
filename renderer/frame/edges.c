#include "renderer/frame/edges.h"
#include "renderer/frame/needs.h"
#include "renderer/passes/draw/places.h"
#include "renderer/passes/draw/screen.h"

#define BAND_PIXELS (4u << 20) /* whose places are in memory together: 64 MiB */

bool frame_edges_are_smooth(const struct frame_job *job)
{
    const struct pen_request *r = job->request;
    return r->edges == PEN_EDGES_SMOOTH && r->antialias == 1 && !job->scene->has_blend &&
           frame_needs(r, PEN_SOURCE_BEAUTY);
}

static bool blend(const struct frame_job *job, const struct gl_texture *picture,
    const char *defines, const struct edges_block *block, struct pen_error *error)
{
    struct frame_targets *t = job->targets;
    struct pass_texture textures[] = {
        {UNIT_DEPTH, t->gbuffer.depth.texture.name, GL_SAMPLE_NEAREST},
        {UNIT_NORMAL, t->gbuffer.normal.texture.name, GL_SAMPLE_NEAREST},
        {UNIT_PLACES, t->places.texture.name, GL_SAMPLE_NEAREST},
        {UNIT_SOURCE, picture->name, GL_SAMPLE_NEAREST}};
    return pass_fill(job->ctx,
        &(struct pass_fill){.name = "edges",
            .fragment = "edges.frag",
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

bool frame_edges_blend(const struct frame_job *job, const struct view *view, bool resolved,
    bool raw, struct pen_error *error)
{
    struct frame_targets *t = job->targets;
    const struct pen_request *r = job->request;
    const char *defines = resolved ? "#define RESOLVED\n" : raw ? "#define RAW\n" : NULL;
    uint32_t most = BAND_PIXELS / r->width;
    for (uint32_t first = 0; first < r->height; first += most) {
        uint32_t rows = r->height - first < most ? r->height - first : most;
        struct edges_block block;
        if (!pass_places(
                job->ctx, job->scene, view, r->ground.on, first, rows, &t->places, &block, error))
            return false;
        bool ok =
            blend(job, resolved ? &t->stairs.texture : &t->beauty.texture, defines, &block, error);
        if (!ok)
            return false;
    }
    return true;
}
