#include "renderer/edges/cover.h"
#include "protocol/memory.h"
#include "renderer/edges/cover_alpha.h"
#include "renderer/edges/cover_triangle.h"
#include "renderer/trace/parallel.h"
#include <cglm/cglm.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define FAR_OUT 1e6f /* px: from here on a corner's place is not exact enough */
#define MOST_WAITING (1u << 15)
#define MOST_GROUPS 64
#define DISTANCES 1024
#define FEW 4096  /* triangles: for so many no threads are started */
#define STRIPES 2 /* of the picture per thread */

/* In clip space. */
struct clip_corner {
    float c[4], at[3];
};

struct group {
    struct cover_drawing drawing;
    struct cover_alpha alpha;
};

/* A triangle that may be seen. */
struct waiting {
    struct cover_corner corners[3];
    struct cover_box box;
    uint32_t group;
};

/* What was met of the scene, to be drawn from the nearest on: what that hides is looked at no more. */
struct queue {
    const struct cover *cover;
    uint32_t count, group_count;
    struct group groups[MOST_GROUPS]; /* the last one is that which is met */
    struct waiting waiting[MOST_WAITING];
    struct entry {
        uint32_t number, y0, y1; /* its box's */
    } order[MOST_WAITING];
    uint32_t stripe_count;
};

static struct cover_corner on_screen(const struct cover *cover, const struct clip_corner *clip)
{
    float inverse = 1 / clip->c[3];
    struct cover_corner c = {(0.5f + 0.5f * clip->c[0] * inverse) * (float)cover->width,
        (0.5f - 0.5f * clip->c[1] * inverse) * (float)cover->height, clip->c[2] * inverse,
        {clip->at[0], clip->at[1], clip->at[2]}};
    return c;
}

/* To one side of a plane of clip space: where dot(plane, corner) >= 0. */
static int clip_to(
    const float plane[4], const struct clip_corner *in, int count, struct clip_corner *out)
{
    int kept = 0;
    for (int i = 0; i < count; i++) {
        const struct clip_corner *a = &in[i], *b = &in[(i + 1) % count];
        float da = 0, db = 0;
        for (int k = 0; k < 4; k++)
            da += plane[k] * a->c[k], db += plane[k] * b->c[k];
        if (da >= 0)
            out[kept++] = *a;
        if ((da >= 0) == (db >= 0))
            continue;
        float t = da / (da - db);
        for (int k = 0; k < 4; k++)
            out[kept].c[k] = a->c[k] + t * (b->c[k] - a->c[k]);
        for (int k = 0; k < 3; k++)
            out[kept].at[k] = a->at[k] + t * (b->at[k] - a->at[k]);
        kept++;
    }
    return kept;
}

static uint32_t bucket(float nearest, float most, float scale)
{
    return (uint32_t)((most - nearest) * scale);
}

static void sort(struct queue *q)
{
    uint32_t first[DISTANCES + 1] = {0};
    float most = 0, least = 1;
    for (uint32_t i = 0; i < q->count; i++) {
        most = fmaxf(most, q->waiting[i].box.nearest);
        least = fminf(least, q->waiting[i].box.nearest);
    }
    float scale = (DISTANCES - 1) / fmaxf(most - least, 1e-30f);
    for (uint32_t i = 0; i < q->count; i++)
        first[bucket(q->waiting[i].box.nearest, most, scale) + 1]++;
    for (uint32_t i = 0; i < DISTANCES; i++)
        first[i + 1] += first[i];
    for (uint32_t i = 0; i < q->count; i++) {
        const struct waiting *w = &q->waiting[i];
        uint32_t to = first[bucket(w->box.nearest, most, scale)]++;
        q->order[to] = (struct entry){i, w->box.y0, w->box.y1};
    }
}

/* Rows of tiles that no other stripe has. */
static void draw_stripe(void *context, uint32_t stripe)
{
    const struct queue *q = context;
    struct cover part = *q->cover;
    uint32_t first = part.first / COVER_TILE, end = part.first + part.rows;
    uint32_t tiles = (end + COVER_TILE - 1) / COVER_TILE - first;
    uint32_t from = first + tiles * stripe / q->stripe_count;
    uint32_t until = first + tiles * (stripe + 1) / q->stripe_count;
    part.first = from * COVER_TILE > part.first ? from * COVER_TILE : part.first;
    part.rows = (until * COVER_TILE < end ? until * COVER_TILE : end) - part.first;
    for (uint32_t i = 0; i < q->count && from < until; i++) {
        const struct entry *entry = &q->order[i];
        if (entry->y0 >= part.first + part.rows || entry->y1 < part.first)
            continue;
        const struct waiting *w = &q->waiting[entry->number];
        cover_draw(&part, &q->groups[w->group].drawing, w->corners, &w->box);
    }
}

/* All that waits. */
static void draw(struct queue *q)
{
    uint32_t threads = q->count > FEW ? trace_thread_count(0) : 1;
    q->stripe_count = threads > 1 ? STRIPES * threads : 1;
    const struct trace_work work = {draw_stripe, q, q->stripe_count, NULL, 0, NULL};
    double cpu_seconds = 0;
    sort(q);
    trace_parallel(threads, &work, &cpu_seconds);
    q->count = 0;
}

static void take(struct queue *q, const struct cover_corner c[3])
{
    struct cover_box box;
    if (!cover_may_show(q->cover, c, &box))
        return;
    q->waiting[q->count++] = (struct waiting){{c[0], c[1], c[2]}, box, q->group_count - 1};
    if (q->count == MOST_WAITING)
        draw(q);
}

static void take_clipped(struct queue *q, const struct clip_corner c[3])
{
    static const float planes[5][4] = {
        {0, 0, -1, 1}, {1, 0, 0, 1}, {-1, 0, 0, 1}, {0, 1, 0, 1}, {0, -1, 0, 1}};
    struct clip_corner room[2][8] = {{c[0], c[1], c[2]}};
    int count = 3;
    for (int i = 0; i < 5; i++)
        count = clip_to(planes[i], room[i % 2], count, room[(i + 1) % 2]);
    const struct clip_corner *left = room[1];
    for (int i = 2; i < count; i++) {
        struct cover_corner part[3] = {on_screen(q->cover, &left[0]),
            on_screen(q->cover, &left[i - 1]), on_screen(q->cover, &left[i])};
        take(q, part);
    }
}

static cover_places column(const mat4 matrix, int number)
{
    cover_places c;
    memcpy(&c, matrix[number], sizeof c);
    return c;
}

static void to_clip(const mat4 matrix, const float at[3], float clip[4])
{
    cover_places c = column(matrix, 0) * at[0] + column(matrix, 1) * at[1] +
                     column(matrix, 2) * at[2] + column(matrix, 3);
    memcpy(clip, &c, sizeof c);
}

/* An instance, and its vertices as far as they are known. */
struct source {
    const struct psc_scene *scene;
    uint32_t first_vertex;
    mat4 to_clip; /* of its own space */
    struct cover_corner *corners;
    const struct cover_alpha *alpha; /* of its group */
};

static struct clip_corner clip_corner(const struct source *s, uint32_t vertex)
{
    struct clip_corner c = {0};
    to_clip(s->to_clip, s->scene->positions[vertex], c.c);
    if (s->alpha)
        cover_alpha_vertex(s->alpha, &s->scene->attributes[vertex], c.at);
    return c;
}

static const struct cover_corner *corner(
    const struct cover *cover, struct source *s, uint32_t vertex)
{
    struct cover_corner *c = &s->corners[vertex - s->first_vertex];
    if (c->z >= 0)
        return c;
    struct clip_corner clip = clip_corner(s, vertex);
    *c = on_screen(cover, &clip);
    if (!(clip.c[3] > clip.c[2] && fabsf(c->x) < FAR_OUT && fabsf(c->y) < FAR_OUT))
        c->z = 2;
    return c;
}

static void take_triangle(struct queue *q, struct source *s, const uint32_t vertices[3])
{
    struct cover_corner c[3];
    for (int i = 0; i < 3; i++)
        c[i] = *corner(q->cover, s, vertices[i]);
    if (c[0].z < 2 && c[1].z < 2 && c[2].z < 2) {
        take(q, c);
        return;
    }
    struct clip_corner whole[3];
    for (int i = 0; i < 3; i++)
        whole[i] = clip_corner(s, vertices[i]);
    take_clipped(q, whole);
}

static struct queue *make_queue(const struct cover *cover)
{
    struct queue *q = pen_alloc(1, sizeof *q);
    q->cover = cover;
    q->count = q->group_count = 0;
    return q;
}

/* What is taken from now on belongs to it. */
static void next_group(struct queue *q, const struct cover_drawing *drawing)
{
    if (q->group_count == MOST_GROUPS) {
        draw(q);
        q->group_count = 0;
    }
    q->groups[q->group_count++].drawing = *drawing;
}

void cover_one_triangle(const float (*corners)[3], const struct cover *cover)
{
    struct queue *q = make_queue(cover);
    struct clip_corner whole[3] = {0};
    for (int i = 0; i < 3; i++)
        to_clip(cover->world_to_clip, corners[i], whole[i].c);
    next_group(q, &(struct cover_drawing){0});
    take_clipped(q, whole);
    draw(q);
    free(q);
}

static void aim(const struct cover *cover, const struct psc_instance *instance, mat4 matrix)
{
    mat4 world;
    glm_mat4_identity(world);
    for (int row = 0; row < 3; row++)
        for (int column = 0; column < 4; column++)
            world[column][row] = instance->world[4 * row + column];
    glm_mat4_mul((vec4 *)cover->world_to_clip, world, matrix);
}

/* What culling left of an instance. */
static void take_runs(struct queue *q, const struct cull_list *list, uint32_t instance,
    struct source *s, size_t *room)
{
    const struct psc_scene *blob = list->blob;
    const struct psc_primitive *primitive = &blob->primitives[blob->instances[instance].primitive];
    if (!list->count)
        return;
    s->scene = blob;
    s->first_vertex = primitive->first_vertex;
    s->corners = pen_grow(s->corners, room, primitive->vertex_count, sizeof *s->corners);
    for (uint32_t i = 0; i < primitive->vertex_count; i++)
        s->corners[i].z = -1;
    aim(q->cover, &blob->instances[instance], s->to_clip);
    for (uint32_t c = 0; c < list->count; c++) {
        const struct cull_command *run = &list->commands[c];
        for (uint32_t i = 0; i < run->count; i += 3)
            take_triangle(q, s, blob->indices + run->first_index + i);
    }
}

void cover_scene(struct scene *scene, const struct cull_view *view, const struct cover_scene *what,
    const struct cover *cover, struct cull_piece *piece)
{
    struct source source = {0};
    size_t room = 0;
    struct queue *queue = make_queue(cover);
    struct cull_list list = {
        &scene->blob, scene->meshlet_areas, scene->command_room, 0, scene->command_count, 1};
    piece->more = false;
    for (; piece->group < scene->group_count; piece->group++, piece->instance = 0) {
        const struct scene_group *group = &scene->groups[piece->group];
        struct cover_drawing d = {
            .cull_back = scene_culls_back(scene, group, view), .mirrored = group->mirrored};
        if (what->blended && !group->blend)
            continue;
        next_group(queue, &d);
        struct group *to = &queue->groups[queue->group_count - 1];
        if (group->alpha) {
            cover_alpha_begin(&to->alpha, &scene->blob, group->material, what->threshold);
            to->drawing.alpha = &to->alpha;
        }
        source.alpha = to->drawing.alpha;
        list.weight = group->alpha ? CULL_TEXTURED_WEIGHT : 1;
        for (; piece->instance < group->count; piece->instance++) {
            uint32_t instance = scene->order[group->first + piece->instance];
            list.count = 0;
            cull_instance(view, instance, d.cull_back, &list, piece);
            take_runs(queue, &list, instance, &source, &room);
            if (piece->more)
                goto done;
        }
    }
done:
    draw(queue);
    free(queue);
    free(source.corners);
}
