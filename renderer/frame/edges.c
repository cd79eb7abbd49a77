#include "renderer/frame/edges.h"
#include "protocol/memory.h"
#include "renderer/frame/needs.h"
#include "renderer/edges/edge_light.h"
#include "renderer/passes/draw/passes.h"
#include "renderer/passes/draw/places.h"
#include "renderer/passes/draw/screen.h"
#include "renderer/passes/draw/tiles.h"
#include "renderer/passes/draw/turn.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

_Static_assert(OPEN_TILE == 4 && COVER_TILE == 4, "edge_tiles.frag looks at so many");

#define BLEND_PIXELS (1u << 16) /* between two turns */
#define BAND_PIXELS (4u << 20)  /* whose places are in memory together: 64 MiB at most */

bool frame_edges_are_smooth(const struct frame_job *job)
{
    const struct pen_request *r = job->request;
    return r->edges == PEN_EDGES_SMOOTH && r->antialias == 1 && frame_needs(r, PEN_SOURCE_BEAUTY);
}

bool frame_edges_are_drawn(const struct frame_job *job)
{
    return frame_edges_are_smooth(job) && !job->ctx->software;
}

/* What shows no edge stays as it is. */
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
    char defines[64];
    snprintf(defines, sizeof defines, "%s%s", layered ? "#define LAYERED\n" : "",
        resolved ? "#define RESOLVED\n"
        : raw    ? "#define RAW\n"
                 : "");
    uint32_t most = BAND_PIXELS / r->width / OPEN_TILE * OPEN_TILE;
    const struct gl_texture *tiles;
    if (!fill(job, resolved, raw, error) || !find_tiles(job, &tiles, error))
        return false;
    bool ok = true;
    for (uint32_t first = 0; ok && first < r->height; first += most) {
        uint32_t rows = r->height - first < most ? r->height - first : most;
        struct places_pass solid = {layered ? PLACES_SOLID : PLACES_ALL, r->ground.on, first, rows};
        struct places_pass front = {PLACES_BLENDED, false, first, rows};
        struct edges_block block;
        ok = pass_places(job->ctx, job->scene, view, &solid, &t->places, &block, error) &&
             (!layered || pass_places(job->ctx, job->scene, view, &front, &t->front_places, &block,
                              error)) &&
             blend(job, resolved ? &t->stairs.texture : &t->beauty.texture, defines, &block, tiles,
                 error);
    }
    return ok;
}

/* What the CPU knows of some rows. */
struct band {
    const struct frame_job *job;
    struct edge_rows rows;
    struct cover_tile *tiles; /* of the whole picture */
    cover_places *places[2];
    uint8_t *before, *last; /* the row above the next band */
};

/* The whole picture is one band, of which all is known but what it looks like. */
struct frame_edges {
    bool known;
    struct band band;
    struct view view;       /* band.rows has it */
    struct cover_tile *all; /* that any picture may show */
    struct gl_texture memory;
};

static void read_depths(const struct band *b, const struct gl_texture *texture, float *depths)
{
    const struct edge_rows *e = &b->rows;
    uint32_t from = e->first ? e->first - 1 : 0, end = e->first + e->rows, width = texture->width;
    uint32_t stride = edge_stride(width);
    end += end < texture->height;
    gl.PixelStorei(GL_PACK_ROW_LENGTH, (GLint)stride);
    gl.GetTextureSubImage(texture->name, 0, 0, (GLint)from, 0, (GLsizei)width,
        (GLsizei)(end - from), 1, GL_DEPTH_COMPONENT, GL_FLOAT,
        (GLsizei)(stride * (end - from) * sizeof *depths),
        depths + (size_t)(from + 1 - e->first) * stride + EDGE_MARGIN);
    gl.PixelStorei(GL_PACK_ROW_LENGTH, 0);
    edge_pad(e, depths);
}

static void read_normals(
    const struct band *b, const struct gl_texture *texture, uint16_t (*normals)[4])
{
    const struct edge_rows *e = &b->rows;
    uint32_t from = e->first ? e->first - 1 : 0, end = e->first + e->rows, width = texture->width;
    end += end < texture->height;
    gl.GetTextureSubImage(texture->name, 0, 0, (GLint)from, 0, (GLsizei)width,
        (GLsizei)(end - from), 1, GL_RGBA, GL_UNSIGNED_SHORT,
        (GLsizei)(width * (end - from) * sizeof *normals),
        normals + (size_t)(from + 1 - e->first) * width);
}

/* What was drawn. */
static void read_rows(struct band *b)
{
    struct edge_rows *e = &b->rows;
    const struct frame_targets *t = b->job->targets;
    read_depths(b, &t->gbuffer.depth.texture, e->solid.depths);
    read_normals(b, &t->gbuffer.normal.texture, e->solid.normals);
    if (e->layered) {
        read_depths(b, &t->front_depth.texture, e->front.depths);
        read_normals(b, &t->front_normal.texture, e->front.normals);
        size_t count = (size_t)edge_stride(e->view->width) * (e->rows + 2 + OPEN_TILE);
        for (size_t i = 0; i < count; i++)
            e->nearest[i] = fmaxf(e->solid.depths[i], e->front.depths[i]);
    }
}

/* The picture before edges are made smooth in it. */
static void copy_rows(struct band *b)
{
    const struct edge_rows *e = &b->rows;
    uint32_t end = e->first + e->rows;
    size_t row = (size_t)e->view->width * edge_pixel_bytes(e->plane);
    memcpy(b->before, b->last, row);
    memcpy(b->before + row, (const uint8_t *)e->plane->data + e->first * row,
        (e->rows + (end < e->view->height)) * row);
    memcpy(b->last, b->before + e->rows * row, row);
}

static uint32_t tile_count(const struct view *v)
{
    return ((v->width + OPEN_TILE - 1) / OPEN_TILE) * ((v->height + OPEN_TILE - 1) / OPEN_TILE);
}

static void take_memory(struct band *b, uint32_t rows)
{
    struct edge_rows *e = &b->rows;
    uint32_t width = e->view->width;
    size_t depths = (size_t)edge_stride(width) * (rows + 2 + OPEN_TILE);
    size_t pixels = (size_t)width * (rows + 2);
    struct edge_surface *surfaces[] = {&e->solid, &e->front};
    for (int i = 0; i < 1 + e->layered; i++) {
        surfaces[i]->depths = pen_alloc(depths, sizeof *e->nearest);
        surfaces[i]->normals = pen_alloc(pixels, sizeof *e->solid.normals);
    }
    e->nearest = e->layered ? pen_alloc(depths, sizeof *e->nearest) : NULL;
    b->tiles = pen_alloc(tile_count(e->view), sizeof *b->tiles);
    e->before = b->before = pen_alloc(pixels, edge_pixel_bytes(e->plane));
    b->last = pen_alloc_zero(width, edge_pixel_bytes(e->plane));
}

static void free_places(struct band *b)
{
    for (int i = 0; i < 2; i++) {
        free(b->places[i]);
        b->places[i] = NULL;
    }
}

static void free_memory(struct band *b)
{
    struct edge_rows *e = &b->rows;
    free(e->solid.depths);
    free(e->solid.normals);
    free(e->front.depths);
    free(e->front.normals);
    free(e->nearest);
    free(b->tiles);
    free(b->before);
    free(b->last);
    free_places(b);
}

static bool cover_band(struct band *b, uint32_t slots, struct pen_error *error)
{
    const struct frame_job *job = b->job;
    struct edge_rows *e = &b->rows;
    size_t places = (size_t)slots * COVER_PIXELS;
    const struct places_pass passes[] = {
        {e->layered ? PLACES_SOLID : PLACES_ALL, job->request->ground.on, e->first, e->rows},
        {PLACES_BLENDED, false, e->first, e->rows}};
    float *least = pen_alloc(places, sizeof *least);
    bool ok = true;
    free_places(b);
    for (int i = 0; ok && i < 1 + e->layered; i++) {
        b->places[i] = pen_alloc(places, sizeof **b->places);
        edge_begin(e, b->tiles, b->places[i], least);
        ok = pass_cover(
            job->ctx, job->scene, e->view, &passes[i], b->tiles, b->places[i], least, error);
    }
    e->solid.places = b->places[0];
    e->front.places = b->places[1];
    free(least);
    return ok;
}

static bool blend_band(struct band *b, struct pen_error *error)
{
    struct technique_ctx *ctx = b->job->ctx;
    const struct edge_rows *e = &b->rows;
    bool ok = true;
    gl_timer_begin(&ctx->timer, PEN_STAGE_SHADE, "edges");
    uint32_t end = e->first + e->rows;
    uint32_t most = (BLEND_PIXELS / e->view->width / OPEN_TILE + 1) * OPEN_TILE;
    for (uint32_t y = e->first; ok && y < end; y += most) {
        edge_blend(e, b->tiles, y, end - y < most ? end : y + most);
        ok = pass_turn_inside(ctx, error);
    }
    gl_timer_end(&ctx->timer);
    return ok;
}

static bool smooth_band(struct band *b, struct pen_error *error)
{
    struct gl_timer *timer = &b->job->ctx->timer;
    gl_timer_begin(timer, PEN_STAGE_SHADE, "edge tiles");
    read_rows(b);
    copy_rows(b);
    uint32_t slots = edge_find(&b->rows, false, b->tiles);
    gl_timer_end(timer);
    return pass_turn(b->job->ctx, error) &&
           (!slots || (cover_band(b, slots, error) && blend_band(b, error)));
}

static struct band make_band(const struct frame_job *job, const struct view *view, bool raw)
{
    return (struct band){.job = job,
        .rows = {.view = view,
            .focal = 0.5f * (float)view->height / tanf(0.5f * view->fov_y_rad),
            .layered = frame_is_layered(job),
            .raw = raw}};
}

static uint32_t most_rows(uint32_t width)
{
    return BAND_PIXELS / width / OPEN_TILE * OPEN_TILE;
}

void frame_edges_keep(const struct frame_job *job)
{
    const struct pen_request *r = job->request;
    if (!job->targets->edges && frame_edges_are_smooth(job) && !frame_edges_are_drawn(job) &&
        r->height <= most_rows(r->width))
        job->targets->edges = pen_alloc_zero(1, sizeof *job->targets->edges);
}

void frame_edges_drop(struct frame_targets *targets)
{
    struct frame_edges *kept = targets->edges;
    if (!kept)
        return;
    gl_texture_release_account(&kept->memory);
    if (kept->band.tiles)
        free_memory(&kept->band);
    free(kept->all);
    free(kept);
    targets->edges = NULL;
}

/* All that the picture's surfaces say. */
static bool know(struct frame_edges *kept, struct pen_error *error)
{
    struct band *b = &kept->band;
    struct edge_rows *e = &b->rows;
    struct gl_timer *timer = &b->job->ctx->timer;
    gl_timer_begin(timer, PEN_STAGE_SHADE, "edge tiles");
    read_rows(b);
    uint32_t slots = edge_find(e, true, b->tiles);
    memcpy(kept->all, b->tiles, tile_count(e->view) * sizeof *kept->all);
    gl_timer_end(timer);
    uint64_t pixel = sizeof *e->nearest + sizeof *e->solid.normals, kinds = 1 + e->layered;
    gl_textures_count(&kept->memory, kinds * ((uint64_t)slots * COVER_PIXELS * sizeof **b->places +
                                                 pixel * e->view->width * e->rows));
    return pass_turn(b->job->ctx, error) && cover_band(b, slots, error);
}

static bool smooth_kept(struct frame_edges *kept, const struct frame_job *job,
    const struct view *view, bool raw, struct pen_plane *plane, struct pen_error *error)
{
    struct band *b = &kept->band;
    struct gl_timer *timer = &job->ctx->timer;
    if (!b->tiles) {
        kept->view = *view;
        *b = make_band(job, &kept->view, raw);
        b->rows.plane = plane;
        b->rows.rows = view->height;
        take_memory(b, view->height);
        kept->all = pen_alloc(tile_count(view), sizeof *kept->all);
    }
    b->rows.plane = plane;
    if (!kept->known && !know(kept, error))
        return false;
    kept->known = true;
    gl_timer_begin(timer, PEN_STAGE_SHADE, "edge tiles");
    copy_rows(b);
    edge_choose(&b->rows, kept->all, b->tiles);
    gl_timer_end(timer);
    return pass_turn(job->ctx, error) && blend_band(b, error);
}

bool frame_edges_smooth(const struct frame_job *job, const struct view *view, bool raw,
    struct pen_plane *plane, struct pen_error *error)
{
    uint32_t height = view->height, most = most_rows(view->width);
    if (job->targets->edges)
        return smooth_kept(job->targets->edges, job, view, raw, plane, error);
    struct band b = make_band(job, view, raw);
    b.rows.plane = plane;
    bool ok = true;
    take_memory(&b, most < height ? most : height);
    for (; ok && b.rows.first < height; b.rows.first += most) {
        b.rows.rows = height - b.rows.first < most ? height - b.rows.first : most;
        ok = smooth_band(&b, error);
    }
    free_memory(&b);
    return ok;
}
