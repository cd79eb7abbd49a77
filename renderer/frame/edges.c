#include "renderer/frame/edges.h"
#include "protocol/memory.h"
#include "renderer/frame/needs.h"
#include "renderer/passes/draw/passes.h"
#include "renderer/passes/draw/places.h"
#include "renderer/passes/draw/screen.h"
#include "renderer/passes/draw/tiles.h"
#include "renderer/passes/draw/turn.h"
#include "renderer/scene/cover.h"
#include <stdio.h>
#include <stdlib.h>

_Static_assert(OPEN_TILE == 4 && COVER_TILE == 4, "edge_tiles.frag looks at so many");

#define BAND_PIXELS (4u << 20) /* whose places are in memory together: 64 MiB */

bool frame_edges_are_smooth(const struct frame_job *job)
{
    const struct pen_request *r = job->request;
    return r->edges == PEN_EDGES_SMOOTH && r->antialias == 1 && frame_needs(r, PEN_SOURCE_BEAUTY);
}

/* What shows no edge stays as it is. Software rasterisers run all of a shader for every pixel, so
 * only tiles with edges are drawn. */
static bool find_tiles(
    const struct frame_job *job, const struct gl_texture **tiles, struct pen_error *error)
{
    static const struct pass_targets key = {1};
    struct gl_target *target = pass_targets(job->ctx, &key);
    uint32_t width = (job->request->width + OPEN_TILE - 1) / OPEN_TILE;
    uint32_t height = (job->request->height + OPEN_TILE - 1) / OPEN_TILE;
    gl_target_fit(target, GL_RGBA32F, width, height, 0, 1);
    bool layered = frame_is_layered(job);
    struct pass_texture depths[] = {
        {UNIT_DEPTH, job->targets->gbuffer.depth.texture.name, GL_SAMPLE_NEAREST},
        {UNIT_BEFORE, job->targets->front_depth.texture.name, GL_SAMPLE_NEAREST}};
    *tiles = &target->texture;
    return pass_fill(job->ctx,
        &(struct pass_fill){.name = "edge tiles",
            .fragment = "edge_tiles.frag",
            .stage = PEN_STAGE_SHADE,
            .defines = layered ? "#define LAYERED\n" : NULL,
            .textures = depths,
            .texture_count = layered ? 2 : 1,
            .framebuffer = target->framebuffer,
            .width = width,
            .height = height},
        error);
}

/* Of which pixels places have to be known, and before what. The caller frees it. */
static struct cover_tile *read_tiles(const struct frame_job *job, const struct gl_texture *tiles)
{
    size_t n = (size_t)tiles->width * tiles->height;
    float(*found)[4] = pen_alloc(n, sizeof *found);
    struct cover_tile *wanted = pen_alloc(n, sizeof *wanted);
    gl_timer_begin(&job->ctx->timer, PEN_STAGE_SHADE, "edge tiles");
    gl.GetTextureImage(tiles->name, 0, GL_RGBA, GL_FLOAT, (GLsizei)(n * sizeof *found), found);
    for (size_t i = 0; i < n; i++)
        wanted[i] = (struct cover_tile){found[i][1], (uint32_t)(found[i][2] + 0.5f)};
    gl_timer_end(&job->ctx->timer);
    free(found);
    return wanted;
}

static bool blend(const struct frame_job *job, const struct gl_texture *picture,
    const char *defines, const struct edges_block *block, const struct gl_texture *tiles,
    struct pen_error *error)
{
    struct frame_targets *t = job->targets;
    struct pass_texture textures[] = {
        {UNIT_DEPTH, t->gbuffer.depth.texture.name, GL_SAMPLE_NEAREST},
        {UNIT_NORMAL, t->gbuffer.normal.texture.name, GL_SAMPLE_NEAREST},
        {UNIT_PLACES, t->places.texture.name, GL_SAMPLE_NEAREST},
        {UNIT_SOURCE, picture->name, GL_SAMPLE_NEAREST},
        {UNIT_BEFORE, t->front_depth.texture.name, GL_SAMPLE_NEAREST},
        {UNIT_FRONT_NORMAL, t->front_normal.texture.name, GL_SAMPLE_NEAREST},
        {UNIT_FRONT_PLACES, t->front_places.texture.name, GL_SAMPLE_NEAREST}};
    return pass_fill(job->ctx,
        &(struct pass_fill){.name = "edges",
            .fragment = "edges.frag",
            .defines = defines,
            .stage = PEN_STAGE_SHADE,
            .textures = textures,
            .texture_count = frame_is_layered(job) ? 7 : 4,
            .framebuffer = t->color.framebuffer,
            .width = job->request->width,
            .height = job->request->height,
            .tiles = tiles,
            .tile_px = OPEN_TILE,
            .extra = block,
            .extra_bytes = sizeof *block},
        error);
}

/* What the file holds without edges. */
static bool fill(const struct frame_job *job, bool resolved, bool raw, struct pen_error *error)
{
    struct frame_targets *t = job->targets;
    const struct pen_request *r = job->request;
    struct edges_block all = {.rows = {0, (int32_t)r->height}};
    if (!resolved)
        return blend(job, &t->beauty.texture,
            raw ? "#define ALONE\n#define RAW\n" : "#define ALONE\n", &all, NULL, error);
    gl_timer_begin(&job->ctx->timer, PEN_STAGE_SHADE, "edges");
    gl.CopyImageSubData(t->stairs.texture.name, GL_TEXTURE_2D, 0, 0, 0, 0, t->color.texture.name,
        GL_TEXTURE_2D, 0, 0, 0, 0, (GLsizei)r->width, (GLsizei)r->height, 1);
    gl_timer_end(&job->ctx->timer);
    return pass_turn(job->ctx, error);
}

bool frame_edges_blend(const struct frame_job *job, const struct view *view, bool resolved,
    bool raw, struct pen_error *error)
{
    struct frame_targets *t = job->targets;
    const struct pen_request *r = job->request;
    bool layered = frame_is_layered(job);
    char defines[96];
    snprintf(defines, sizeof defines, "%s%s%s", layered ? "#define LAYERED\n" : "",
        job->ctx->software ? "#define GATHERED\n" : "",
        resolved ? "#define RESOLVED\n"
        : raw    ? "#define RAW\n"
                 : "");
    uint32_t most = BAND_PIXELS / r->width / OPEN_TILE * OPEN_TILE;
    const struct gl_texture *tiles;
    if (!fill(job, resolved, raw, error) || !find_tiles(job, &tiles, error))
        return false;
    bool ok = true;
    /* Elsewhere than in software it costs less to draw all than to wait for what was drawn. */
    struct cover_tile *wanted = job->ctx->software ? read_tiles(job, tiles) : NULL;
    for (uint32_t first = 0; ok && first < r->height; first += most) {
        uint32_t rows = r->height - first < most ? r->height - first : most;
        struct places_pass solid = {
            layered ? PLACES_SOLID : PLACES_ALL, r->ground.on, first, rows, wanted};
        struct places_pass front = {PLACES_BLENDED, false, first, rows, wanted};
        struct edges_block block;
        ok = pass_places(job->ctx, job->scene, view, &solid, &t->places, &block, error) &&
             (!layered || pass_places(job->ctx, job->scene, view, &front, &t->front_places, &block,
                              error)) &&
             blend(job, resolved ? &t->stairs.texture : &t->beauty.texture, defines, &block, tiles,
                 error);
    }
    free(wanted);
    return ok;
}
