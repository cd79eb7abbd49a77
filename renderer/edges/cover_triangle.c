#include "renderer/edges/cover_triangle.h"
#include <math.h>
#include <string.h>

const cover_places cover_across = {-0.125f, 0.375f, -0.375f, 0.125f};
const cover_places cover_down = {-0.375f, -0.125f, 0.125f, 0.375f};

typedef cover_places places;
typedef cover_bits place_bits;

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

static places all(float value)
{
    return (places){value, value, value, value};
}

static places choose(place_bits which, places a, places b)
{
    return (places)((which & (place_bits)a) | (~which & (place_bits)b));
}

static places load(const float *from)
{
    places p;
    memcpy(&p, from, sizeof p);
    return p;
}

/* A bit for each place. */
static uint32_t bits_of(place_bits which)
{
#ifdef __SSE__
    return (uint32_t)__builtin_ia32_movmskps((places)which);
#else
    which &= (place_bits){1, 2, 4, 8};
    return (uint32_t)(which[0] | which[1] | which[2] | which[3]);
#endif
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

static float least_of(places p)
{
    return lesser(lesser(p[0], p[1]), lesser(p[2], p[3]));
}

static double plane_at(const struct plane *p, double x, double y)
{
    return p->at + p->across * x + p->down * y;
}

/* The line from a to b. That from b to a is its negative, bit by bit: neighbours leave no gap. */
static struct plane line(const struct cover_corner *a, const struct cover_corner *b)
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
    t->tile[3] = INFINITY; /* depth is not asked for its sign */
}

/* False: it faces away, or has no area. */
static bool set_up(
    const struct cover_drawing *d, const struct cover_corner c[3], struct triangle *t)
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

/* Of the texture, in the middle of some pixels of the tile at (x, y), whatever is in front of them. */
static float level_in(const struct cover_drawing *d, const struct triangle *t, uint32_t pixels,
    uint32_t x, uint32_t y)
{
    const struct plane *depth = &t->numbers[3];
    uint32_t columns = (pixels | pixels >> 4 | pixels >> 8 | pixels >> 12) & 0xf;
    double px = x + 0.5 * (__builtin_ctz(columns) + 32 - __builtin_clz(columns));
    double py = y + 0.5 * (__builtin_ctz(pixels) / 4 + 1 + (31 - __builtin_clz(pixels)) / 4);
    double middle = fmin(fmax(plane_at(depth, px, py), (double)t->farthest), (double)t->nearest);
    float across[2], down[2];
    for (int k = 0; k < 2; k++) {
        double here = plane_at(&t->alpha[k], px, py) / middle;
        across[k] = (float)((t->alpha[k].across - here * depth->across) / middle);
        down[k] = (float)((t->alpha[k].down - here * depth->down) / middle);
    }
    return cover_alpha_level(d->alpha, across, down);
}

/* Leaves of the places that are covered in a pixel those whose alpha is not cut. */
static place_bits cut(const struct cover_drawing *d, const struct triangle *t, float level,
    double x, double y, place_bits covered)
{
    float middle = (float)plane_at(&t->numbers[3], x, y);
    places at[3], inverse = 1 / (all(middle) + t->offsets[3]);
    for (int k = 0; k < 3; k++)
        at[k] = (all((float)plane_at(&t->alpha[k], x, y)) + t->alpha_offsets[k]) * inverse;
    return cover_alpha_cut(d->alpha, at, level, covered);
}

/* Those of a tile's pixels which may have a place inside and nearer than `least`; first: numbers at the
 * first one. */
static uint32_t near(
    const struct triangle *t, uint32_t pixels, places first, const float least[COVER_PIXELS])
{
    const places steps = {0, 1, 2, 3};
    uint32_t y = (uint32_t)__builtin_ctz(pixels) / COVER_TILE, bits = 0;
    places reach = first + t->pixel + (float)y * t->down, row[3];
    for (int i = 0; i < 3; i++)
        row[i] = all(reach[i]) + t->across[i] * steps;
    for (; pixels >> COVER_TILE * y; y++) {
        place_bits in = (row[0] >= 0.0f) & (row[1] >= 0.0f) & (row[2] >= 0.0f);
        in &= all(t->nearest) > load(least + COVER_TILE * y);
        bits |= bits_of(in) << COVER_TILE * y;
        for (int i = 0; i < 3; i++)
            row[i] += t->down[i];
    }
    return bits & pixels;
}

static float farthest_of(const float least[COVER_PIXELS])
{
    places a = load(least), b = load(least + 4), c = load(least + 8), e = load(least + 12);
    a = choose(a < b, a, b);
    c = choose(c < e, c, e);
    return least_of(choose(a < c, a, c));
}

/* Of the tile whose first pixel is at (x, y) those pixels. */
static void draw_tile(const struct cover *cover, const struct cover_drawing *d,
    const struct triangle *t, uint32_t x, uint32_t y, uint32_t pixels, struct cover_tile *tile)
{
    places *tile_depths = cover->depths + (size_t)tile->slot * COVER_PIXELS;
    float *least = cover->least + (size_t)tile->slot * COVER_PIXELS;
    bool drawn = false;
    places first;
    for (int i = 0; i < 4; i++)
        first[i] = (float)plane_at(&t->numbers[i], x + 0.5, y + 0.5);
    if (bits_of(first + t->tile < 0.0f))
        return;
    float level = NAN; /* one does for all */
    for (uint32_t left = near(t, pixels, first, least); left; left &= left - 1) {
        uint32_t bit = (uint32_t)__builtin_ctz(left);
        places here = first + t->across * (float)(bit % COVER_TILE);
        here += t->down * (float)(bit / COVER_TILE);
        place_bits covered = (all(here[0]) + t->offsets[0] >= 0.0f) &
                             (all(here[1]) + t->offsets[1] >= 0.0f) &
                             (all(here[2]) + t->offsets[2] >= 0.0f);
        places *depths = &tile_depths[bit];
        /* Slivers' planes are steep. */
        places depth = all(here[3]) + t->offsets[3];
        depth = choose(depth > t->nearest, all(t->nearest), depth);
        depth = choose(depth > t->farthest, depth, all(t->farthest));
        covered &= depth > *depths;
        if (!bits_of(covered))
            continue;
        if (d->alpha) {
            double px = x + bit % COVER_TILE + 0.5, py = y + bit / COVER_TILE + 0.5;
            level = isnan(level) ? level_in(d, t, pixels, x, y) : level;
            covered = cut(d, t, level, px, py, covered);
        }
        *depths = choose(covered, depth, *depths);
        least[bit] = least_of(*depths);
        drawn = true;
    }
    if (drawn)
        tile->farthest = farthest_of(least);
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

static bool box_of(const struct cover *cover, const struct cover_corner c[3], struct cover_box *box)
{
    float left = greater(lesser(c[0].x, lesser(c[1].x, c[2].x)), 0);
    float right = lesser(greater(c[0].x, greater(c[1].x, c[2].x)), (float)cover->width - 0.5f);
    float top = greater(lesser(c[0].y, lesser(c[1].y, c[2].y)), (float)cover->first);
    float bottom = lesser(
        greater(c[0].y, greater(c[1].y, c[2].y)), (float)(cover->first + cover->rows) - 0.5f);
    if (!(left <= right && top <= bottom))
        return false;
    *box = (struct cover_box){(uint32_t)left, (uint32_t)right, (uint32_t)top, (uint32_t)bottom,
        greater(c[0].z, greater(c[1].z, c[2].z))};
    return true;
}

/* Of a tile's pixels those that are wanted, in the box and not nearer than it. */
static uint32_t open_pixels(
    const struct cover_tile *tile, const struct cover_box *b, uint32_t x, uint32_t y)
{
    return tile->pixels && b->nearest > tile->farthest
               ? tile->pixels & bits_between(x, y, b->x0, b->x1, b->y0, b->y1)
               : 0;
}

bool cover_may_show(const struct cover *cover, const struct cover_corner c[3], struct cover_box *b)
{
    if (!box_of(cover, c, b))
        return false;
    size_t across = (cover->width + COVER_TILE - 1) / COVER_TILE;
    for (uint32_t row = b->y0 / COVER_TILE; row <= b->y1 / COVER_TILE; row++)
        for (uint32_t column = b->x0 / COVER_TILE; column <= b->x1 / COVER_TILE; column++)
            if (open_pixels(
                    &cover->tiles[row * across + column], b, column * COVER_TILE, row * COVER_TILE))
                return true;
    return false;
}

void cover_draw(const struct cover *cover, const struct cover_drawing *d,
    const struct cover_corner c[3], const struct cover_box *box)
{
    struct triangle t;
    uint32_t last = cover->first + cover->rows - 1;
    struct cover_box part = *box;
    part.y0 = part.y0 > cover->first ? part.y0 : cover->first;
    part.y1 = part.y1 < last ? part.y1 : last;
    t.nearest = part.nearest;
    size_t across = (cover->width + COVER_TILE - 1) / COVER_TILE;
    bool ready = false;
    for (uint32_t row = part.y0 / COVER_TILE; row <= part.y1 / COVER_TILE; row++)
        for (uint32_t column = part.x0 / COVER_TILE; column <= part.x1 / COVER_TILE; column++) {
            struct cover_tile *tile = &cover->tiles[row * across + column];
            uint32_t x = column * COVER_TILE, y = row * COVER_TILE;
            uint32_t pixels = open_pixels(tile, &part, x, y);
            if (!pixels)
                continue;
            places *depths = cover->depths + (size_t)tile->slot * COVER_PIXELS;
            for (int i = 0; i < COVER_PIXELS; i += COVER_TILE)
                __builtin_prefetch(&depths[i]);
            if (!ready && !set_up(d, c, &t))
                return;
            ready = true;
            draw_tile(cover, d, &t, x, y, pixels, tile);
        }
}
