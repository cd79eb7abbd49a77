#include "renderer/edges/cover.h"
#include "protocol/memory.h"
#include "renderer/edges/cover_alpha.h"
#include <cglm/cglm.h>
#include <math.h>
#include <stdlib.h>

#define FAR_OUT 1e6f /* px: from here on a corner's place is not exact enough */

const cover_places cover_across = {-0.125f, 0.375f, -0.375f, 0.125f};
const cover_places cover_down = {-0.375f, -0.125f, 0.125f, 0.375f};

typedef cover_places places;
typedef cover_bits place_bits;
typedef int64_t place_pairs __attribute__((vector_size(4 * COVER_PLACES)));

struct corner {
    float x, y, z; /* px, of the picture; depth. Not known yet: z is below 0; to be clipped: 2 */
    float at[3];   /* cover_alpha_vertex() */
};

/* In clip space. */
struct clip_corner {
    float c[4], at[3];
};

/* A number that is linear over the picture: at its upper left corner, and per pixel. */
struct plane {
    double at, across, down;
};

struct triangle {
    struct plane numbers[4]; /* three that are 0 along an edge, positive inside; depth */
    places across, down;     /* the four numbers', per pixel */
    places tile, pixel;      /* how much more than at its (first) centre they can be in it */
    places offsets[4];       /* of a number at the places */
    float nearest, farthest;
    struct plane alpha[3]; /* cover_alpha_vertex() times depth */
    places alpha_offsets[3];
};

struct drawing {
    const struct cover *cover;
    const struct cover_alpha *alpha; /* NULL: no holes */
    bool cull_back, mirrored;
};

static places all(float value)
{
    return (places){value, value, value, value};
}

static places choose(place_bits which, places a, places b)
{
    return (places)((which & (place_bits)a) | (~which & (place_bits)b));
}

static bool any(place_bits bits)
{
    place_pairs pairs = (place_pairs)bits;
    return pairs[0] | pairs[1];
}

/* fminf and fmaxf would be called. */
static float lesser(float a, float b)
{
    return a < b ? a : b;
}

static float greater(float a, float b)
{
    return a > b ? a : b;
}

static double plane_at(const struct plane *p, double x, double y)
{
    return p->at + p->across * x + p->down * y;
}

/* The line from a to b. That from b to a is its negative, bit by bit: neighbours leave no gap. */
static struct plane line(const struct corner *a, const struct corner *b)
{
    double ax = (double)a->x, ay = (double)a->y, bx = (double)b->x, by = (double)b->y;
    return (struct plane){ax * by - bx * ay, ay - by, bx - ax};
}

/* weights: 1 at one corner each, 0 at the others. */
static struct plane through(const struct plane weights[3], const double values[3])
{
    struct plane p = {0};
    for (int i = 0; i < 3; i++) {
        p.at += weights[i].at * values[i];
        p.across += weights[i].across * values[i];
        p.down += weights[i].down * values[i];
    }
    return p;
}

static struct plane scaled(const struct plane *p, double factor)
{
    return (struct plane){p->at * factor, p->across * factor, p->down * factor};
}

static places over_places(const struct plane *p)
{
    return (float)p->across * cover_across + (float)p->down * cover_down;
}

static void step(struct triangle *t)
{
    for (int i = 0; i < 4; i++) {
        const struct plane *p = &t->numbers[i];
        places offsets = t->offsets[i] = over_places(p);
        t->across[i] = (float)p->across;
        t->down[i] = (float)p->down;
        t->tile[i] = COVER_TILE * (float)(fabs(p->across) + fabs(p->down));
        t->pixel[i] = greater(greater(offsets[0], offsets[1]), greater(offsets[2], offsets[3]));
    }
    t->tile[3] = t->pixel[3] = INFINITY; /* depth is not asked for its sign */
}

/* False: it faces away, or has no area. */
static bool set_up(const struct drawing *d, const struct corner c[3], struct triangle *t)
{
    struct plane weights[3];
    t->numbers[0] = line(&c[1], &c[2]); /* opposite to corner 0 */
    double area = plane_at(&t->numbers[0], (double)c[0].x, (double)c[0].y);
    if (area == 0 || isnan(area) || (d->cull_back && (area > 0) != d->mirrored))
        return false;
    t->numbers[1] = line(&c[2], &c[0]);
    t->numbers[2] = line(&c[0], &c[1]);
    double depths[3], values[3], inverse = 1 / area;
    for (int i = 0; i < 3; i++) {
        depths[i] = (double)c[i].z;
        weights[i] = scaled(&t->numbers[i], inverse);
    }
    t->numbers[3] = through(weights, depths);
    t->farthest = lesser(c[0].z, lesser(c[1].z, c[2].z));
    for (int k = 0; d->alpha && k < 3; k++) {
        for (int i = 0; i < 3; i++)
            values[i] = (double)c[i].at[k] * depths[i];
        t->alpha[k] = through(weights, values);
        t->alpha_offsets[k] = over_places(&t->alpha[k]);
    }
    for (int i = 0; i < 3 && area < 0; i++)
        t->numbers[i] = scaled(&t->numbers[i], -1);
    step(t);
    return true;
}

/* Of the texture; the place may lie outside. */
static float level_at(const struct drawing *d, const struct triangle *t, double x, double y)
{
    const struct plane *depth = &t->numbers[3];
    double middle = plane_at(depth, x, y);
    float across[2], down[2];
    for (int k = 0; k < 2; k++) {
        double here = plane_at(&t->alpha[k], x, y) / middle;
        across[k] = (float)((t->alpha[k].across - here * depth->across) / middle);
        down[k] = (float)((t->alpha[k].down - here * depth->down) / middle);
    }
    return cover_alpha_level(d->alpha, across, down);
}

/* Leaves of the places that are covered in a pixel those whose alpha is not cut. */
static place_bits cut(const struct drawing *d, const struct triangle *t, float level, double x,
    double y, place_bits covered)
{
    float middle = (float)plane_at(&t->numbers[3], x, y);
    places at[3], inverse = 1 / (all(middle) + t->offsets[3]);
    for (int k = 0; k < 3; k++)
        at[k] = (all((float)plane_at(&t->alpha[k], x, y)) + t->alpha_offsets[k]) * inverse;
    return cover_alpha_cut(d->alpha, at, level, covered);
}

/* A bit for each pixel of a tile which may have a place inside; first: numbers at the first one. */
static uint32_t near(const struct triangle *t, places first)
{
    const places steps = {0, 1, 2, 3};
    places reach = first + t->pixel, row[3];
    uint32_t bits = 0;
    for (int i = 0; i < 3; i++)
        row[i] = all(reach[i]) + t->across[i] * steps;
    for (int y = 0; y < COVER_TILE; y++) {
        place_bits out = (row[0] < 0.0f) | (row[1] < 0.0f) | (row[2] < 0.0f);
        place_pairs pairs = (place_pairs)(~out & (place_bits){1, 2, 4, 8});
        uint64_t both = (uint64_t)(pairs[0] | pairs[1]);
        bits |= (uint32_t)(both | both >> 32) << COVER_TILE * y;
        for (int i = 0; i < 3; i++)
            row[i] += t->down[i];
    }
    return bits;
}

/* Of the tile whose first pixel is at (x, y) those pixels. */
static void draw_tile(const struct drawing *d, const struct triangle *t, uint32_t x, uint32_t y,
    uint32_t pixels, places *tile)
{
    places first;
    for (int i = 0; i < 4; i++)
        first[i] = (float)plane_at(&t->numbers[i], x + 0.5, y + 0.5);
    if (any(first + t->tile < 0.0f))
        return;
    float level = NAN; /* the first one's does for all */
    for (uint32_t left = pixels & near(t, first); left; left &= left - 1) {
        uint32_t bit = (uint32_t)__builtin_ctz(left);
        places here = first + t->across * (float)(bit % COVER_TILE);
        here += t->down * (float)(bit / COVER_TILE);
        place_bits covered = (all(here[0]) + t->offsets[0] >= 0.0f) &
                             (all(here[1]) + t->offsets[1] >= 0.0f) &
                             (all(here[2]) + t->offsets[2] >= 0.0f);
        places *depths = &tile[bit];
        /* Slivers' planes are steep. */
        places depth = all(here[3]) + t->offsets[3];
        depth = choose(depth > t->nearest, all(t->nearest), depth);
        depth = choose(depth > t->farthest, depth, all(t->farthest));
        covered &= depth > *depths;
        if (!any(covered))
            continue;
        if (d->alpha) {
            double px = x + bit % COVER_TILE + 0.5, py = y + bit / COVER_TILE + 0.5;
            level = isnan(level) ? level_at(d, t, px, py) : level;
            covered = cut(d, t, level, px, py, covered);
        }
        *depths = choose(covered, depth, *depths);
    }
}

/* Bits of the tile at (x, y) between pixels x0 and x1, y0 and y1. */
static uint32_t bits_between(
    uint32_t x, uint32_t y, uint32_t x0, uint32_t x1, uint32_t y0, uint32_t y1)
{
    uint32_t left = x0 > x ? x0 - x : 0, right = x1 - x < 3 ? x1 - x : 3;
    uint32_t top = y0 > y ? y0 - y : 0, bottom = y1 - y < 3 ? y1 - y : 3;
    uint32_t columns = ((2u << right) - (1u << left)) * 0x1111u;
    return columns & ((0x10u << 4 * bottom) - (1u << 4 * top));
}

static void draw(const struct drawing *d, const struct corner c[3])
{
    const struct cover *cover = d->cover;
    float left = greater(lesser(c[0].x, lesser(c[1].x, c[2].x)), 0);
    float right = lesser(greater(c[0].x, greater(c[1].x, c[2].x)), (float)cover->width - 0.5f);
    float top = greater(lesser(c[0].y, lesser(c[1].y, c[2].y)), (float)cover->first);
    float bottom = lesser(
        greater(c[0].y, greater(c[1].y, c[2].y)), (float)(cover->first + cover->rows) - 0.5f);
    if (!(left <= right && top <= bottom))
        return;
    struct triangle t;
    t.nearest = greater(c[0].z, greater(c[1].z, c[2].z));
    uint32_t x0 = (uint32_t)left, x1 = (uint32_t)right, y0 = (uint32_t)top, y1 = (uint32_t)bottom;
    size_t across = (cover->width + COVER_TILE - 1) / COVER_TILE;
    bool ready = false;
    for (uint32_t row = y0 / COVER_TILE; row <= y1 / COVER_TILE; row++)
        for (uint32_t column = x0 / COVER_TILE; column <= x1 / COVER_TILE; column++) {
            const struct cover_tile *tile = &cover->tiles[row * across + column];
            if (!tile->pixels || t.nearest <= tile->farthest)
                continue;
            uint32_t x = column * COVER_TILE, y = row * COVER_TILE;
            uint32_t pixels = tile->pixels & bits_between(x, y, x0, x1, y0, y1);
            if (!pixels)
                continue;
            places *depths = cover->depths + (size_t)tile->slot * COVER_PIXELS;
            for (int i = 0; i < COVER_PIXELS; i += COVER_TILE)
                __builtin_prefetch(&depths[i]);
            if (!ready && !set_up(d, c, &t))
                return;
            ready = true;
            draw_tile(d, &t, x, y, pixels, depths);
        }
}

static struct corner on_screen(const struct cover *cover, const struct clip_corner *clip)
{
    float inverse = 1 / clip->c[3];
    struct corner c = {(0.5f + 0.5f * clip->c[0] * inverse) * (float)cover->width,
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

static void draw_clipped(const struct drawing *d, const struct clip_corner c[3])
{
    static const float planes[5][4] = {
        {0, 0, -1, 1}, {1, 0, 0, 1}, {-1, 0, 0, 1}, {0, 1, 0, 1}, {0, -1, 0, 1}};
    struct clip_corner room[2][8] = {{c[0], c[1], c[2]}};
    int count = 3;
    for (int i = 0; i < 5; i++)
        count = clip_to(planes[i], room[i % 2], count, room[(i + 1) % 2]);
    const struct clip_corner *left = room[1];
    for (int i = 2; i < count; i++) {
        struct corner part[3] = {on_screen(d->cover, &left[0]), on_screen(d->cover, &left[i - 1]),
            on_screen(d->cover, &left[i])};
        draw(d, part);
    }
}

static void to_clip(const mat4 matrix, const float at[3], float clip[4])
{
    for (int i = 0; i < 4; i++)
        clip[i] = matrix[0][i] * at[0] + matrix[1][i] * at[1] + matrix[2][i] * at[2] + matrix[3][i];
}

/* An instance, and its vertices as far as they are known. */
struct source {
    const struct psc_scene *scene;
    uint32_t first_vertex;
    mat4 to_clip; /* of its own space */
    struct corner *corners;
};

static struct clip_corner clip_corner(
    const struct drawing *d, const struct source *s, uint32_t vertex)
{
    struct clip_corner c = {0};
    to_clip(s->to_clip, s->scene->positions[vertex], c.c);
    if (d->alpha)
        cover_alpha_vertex(d->alpha, &s->scene->attributes[vertex], c.at);
    return c;
}

static const struct corner *corner(const struct drawing *d, struct source *s, uint32_t vertex)
{
    struct corner *c = &s->corners[vertex - s->first_vertex];
    if (c->z >= 0)
        return c;
    struct clip_corner clip = clip_corner(d, s, vertex);
    *c = on_screen(d->cover, &clip);
    if (!(clip.c[3] > clip.c[2] && fabsf(c->x) < FAR_OUT && fabsf(c->y) < FAR_OUT))
        c->z = 2;
    return c;
}

static void draw_triangle(const struct drawing *d, struct source *s, const uint32_t vertices[3])
{
    struct corner c[3];
    for (int i = 0; i < 3; i++)
        c[i] = *corner(d, s, vertices[i]);
    if (c[0].z < 2 && c[1].z < 2 && c[2].z < 2) {
        draw(d, c);
        return;
    }
    struct clip_corner whole[3];
    for (int i = 0; i < 3; i++)
        whole[i] = clip_corner(d, s, vertices[i]);
    draw_clipped(d, whole);
}

void cover_one_triangle(const float (*corners)[3], const struct cover *cover)
{
    const struct drawing d = {.cover = cover};
    struct clip_corner whole[3] = {0};
    for (int i = 0; i < 3; i++)
        to_clip(cover->world_to_clip, corners[i], whole[i].c);
    draw_clipped(&d, whole);
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
static void draw_runs(const struct drawing *d, const struct cull_list *list, uint32_t instance,
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
    aim(d->cover, &blob->instances[instance], s->to_clip);
    for (uint32_t c = 0; c < list->count; c++) {
        const struct cull_command *run = &list->commands[c];
        for (uint32_t i = 0; i < run->count; i += 3)
            draw_triangle(d, s, blob->indices + run->first_index + i);
    }
}

void cover_scene(struct scene *scene, const struct cull_view *view, const struct cover_scene *what,
    const struct cover *cover, struct cull_piece *piece)
{
    struct source source = {0};
    size_t room = 0;
    struct cull_list list = {
        &scene->blob, scene->meshlet_areas, scene->command_room, 0, scene->command_count, 1};
    piece->more = false;
    for (; piece->group < scene->group_count; piece->group++, piece->instance = 0) {
        const struct scene_group *group = &scene->groups[piece->group];
        struct cover_alpha alpha;
        struct drawing d = {.cover = cover,
            .cull_back = scene_culls_back(scene, group, view),
            .mirrored = group->mirrored};
        if (what->blended && !group->blend)
            continue;
        if (group->alpha) {
            cover_alpha_begin(&alpha, &scene->blob, group->material, what->threshold);
            d.alpha = &alpha;
        }
        list.weight = group->alpha ? CULL_TEXTURED_WEIGHT : 1;
        for (; piece->instance < group->count; piece->instance++) {
            uint32_t instance = scene->order[group->first + piece->instance];
            list.count = 0;
            cull_instance(view, instance, d.cull_back, &list, piece);
            draw_runs(&d, &list, instance, &source, &room);
            if (piece->more)
                goto done;
        }
    }
done:
    free(source.corners);
}
