#include "renderer/passes/rays/ray_scene.h"
#include "protocol/container.h"
#include "protocol/memory.h"
#include "renderer/passes/rays/ray_alpha.h"
#include <math.h>
#include <stdlib.h>

static void destroy(struct scene_attachment *attachment)
{
    struct ray_scene *s = container_of(attachment, struct ray_scene, attachment);
    GLuint buffers[] = {s->nodes, s->triangles, s->alpha_triangles, s->alpha_words};
    gl.DeleteBuffers(sizeof buffers / sizeof *buffers, buffers);
    pen_bvh_finish(&s->bvh);
    free(s->first_indices);
    free(s);
}

static GLuint upload(const void *data, uint64_t bytes, bool moves)
{
    GLuint name;
    gl.CreateBuffers(1, &name);
    gl.NamedBufferStorage(name, bytes ? (GLsizeiptr)bytes : 16, bytes ? data : NULL,
        moves ? GL_DYNAMIC_STORAGE_BIT : 0);
    return name;
}

static float extent_of(const struct pen_bvh *bvh)
{
    float extent = 0;
    for (int c = 0; c < 3 && bvh->triangle_count; c++)
        extent = fmaxf(extent, fmaxf(fabsf(bvh->nodes[0].low[c]), fabsf(bvh->nodes[0].high[c])));
    return extent;
}

static bool upload_all(struct technique_run *run, const struct pen_bvh *bvh,
    const struct ray_alpha *alpha, uint64_t max_block, struct pen_error *error)
{
    struct scene *scene = run->scene;
    uint64_t nodes = (uint64_t)bvh->node_count * sizeof *bvh->nodes;
    uint64_t triangles = (uint64_t)bvh->triangle_count * sizeof *bvh->triangles;
    uint64_t records = (uint64_t)alpha->triangle_count * sizeof *alpha->triangles;
    uint64_t bytes = nodes + triangles + records + 4 * alpha->word_count;
    if (nodes > max_block || scene->bytes + bytes > run->ctx->gpu_memory)
        return pen_fail(error, PEN_TOO_BIG, "/scene",
            "Ray tracing the scene needs %.0f MiB of GPU memory beside its %.0f MiB; %.0f MiB are "
            "allowed.",
            (double)bytes / (1 << 20), (double)scene->bytes / (1 << 20),
            (double)run->ctx->gpu_memory / (1 << 20));
    struct ray_scene *s = pen_alloc_zero(1, sizeof *s);
    bool moves = scene->file.motion.animation_count > 0;
    s->nodes = upload(bvh->nodes, nodes, moves);
    s->triangles = upload(bvh->triangles, triangles, moves);
    if (records) {
        s->alpha_triangles = upload(alpha->triangles, records, false);
        s->alpha_words = upload(alpha->words, 4 * alpha->word_count, false);
    }
    s->node_count = bvh->triangle_count ? bvh->node_count : 0;
    s->extent = extent_of(bvh);
    s->moved = scene->moved;
    s->remade = scene->remade;
    s->attachment = (struct scene_attachment){.destroy = destroy, .bytes = bytes};
    scene_attach(scene, &s->attachment);
    return true;
}

/* No hierarchy over more triangles can fit: a leaf holds PEN_BVH_LEAF at most, and a tree has
 * almost two nodes for each leaf. At least 1. */
static uint64_t most_triangles(const struct technique_run *run, uint64_t max_block)
{
    uint64_t have = run->ctx->gpu_memory, used = run->scene->bytes;
    uint64_t each =
        sizeof(struct pen_bvh_triangle) + 2 * sizeof(struct pen_bvh_node) / PEN_BVH_LEAF;
    uint64_t room = have > used ? (have - used) / each : 0;
    uint64_t most = max_block / sizeof(struct pen_bvh_triangle);
    most = room < most ? room : most;
    return most ? most : 1;
}

static uint32_t *list_first_indices(const struct pen_bvh *bvh)
{
    uint32_t *first = pen_alloc(bvh->triangle_count, sizeof *first);
    for (uint32_t i = 0; i < bvh->triangle_count; i++)
        first[i] = bvh->triangles[i].first_index;
    return first;
}

static bool build(struct technique_run *run, struct pen_error *error)
{
    GLint64 max_block = 0;
    gl.GetInteger64v(GL_MAX_SHADER_STORAGE_BLOCK_SIZE, &max_block);
    uint64_t limit = (uint64_t)max_block;
    struct pen_bvh bvh;
    struct ray_alpha alpha = {0};
    uint32_t *first_indices = NULL;
    bool ok = pen_bvh_build_scene(&run->scene->blob, most_triangles(run, limit), &bvh, error);
    if (ok && run->scene->file.motion.animation_count)
        first_indices = list_first_indices(&bvh);
    ok = ok && ray_alpha_make(&run->scene->blob, &bvh, limit, &alpha, error) &&
         upload_all(run, &bvh, &alpha, limit, error);
    ray_alpha_finish(&alpha);
    if (ok && first_indices) {
        struct ray_scene *s =
            container_of(scene_attachment(run->scene, destroy), struct ray_scene, attachment);
        s->bvh = bvh;
        s->first_indices = first_indices;
        return true;
    }
    free(first_indices);
    pen_bvh_finish(&bvh);
    return ok;
}

/* For the scene's pose; false when the hierarchy has to be built anew. */
static bool follow(struct technique_run *run, struct ray_scene *s)
{
    const struct scene *scene = run->scene;
    if (s->remade != scene->remade)
        return false;
    if (s->moved == scene->moved)
        return true;
    gl_timer_begin(&run->ctx->timer, PEN_STAGE_SHADOW, "ray refit");
    bool worth = pen_bvh_refit(&s->bvh, &scene->blob, s->first_indices);
    if (worth) {
        gl.NamedBufferSubData(
            s->nodes, 0, (GLsizeiptr)(s->bvh.node_count * sizeof *s->bvh.nodes), s->bvh.nodes);
        if (s->bvh.triangle_count)
            gl.NamedBufferSubData(s->triangles, 0,
                (GLsizeiptr)(s->bvh.triangle_count * sizeof *s->bvh.triangles), s->bvh.triangles);
        s->extent = extent_of(&s->bvh);
        s->moved = scene->moved;
    }
    gl_timer_end(&run->ctx->timer);
    return worth;
}

const struct ray_scene *ray_scene_get(struct technique_run *run, struct pen_error *error)
{
    struct scene_attachment *known = scene_attachment(run->scene, destroy);
    if (known && !follow(run, container_of(known, struct ray_scene, attachment))) {
        scene_detach(run->scene, known);
        known = NULL;
    }
    if (!known) {
        gl_timer_begin(&run->ctx->timer, PEN_STAGE_SHADOW, "ray hierarchy");
        bool ok = build(run, error);
        gl_timer_end(&run->ctx->timer);
        if (!ok)
            return NULL;
    }
    return container_of(scene_attachment(run->scene, destroy), struct ray_scene, attachment);
}

void ray_scene_bind(const struct ray_scene *s)
{
    gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, STORAGE_RAY_NODES, s->nodes);
    gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, STORAGE_RAY_TRIANGLES, s->triangles);
    if (s->alpha_triangles) {
        gl.BindBufferBase(
            GL_SHADER_STORAGE_BUFFER, STORAGE_RAY_ALPHA_TRIANGLES, s->alpha_triangles);
        gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, STORAGE_RAY_ALPHA_WORDS, s->alpha_words);
    }
}
