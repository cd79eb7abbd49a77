#include "renderer/passes/draw/pieces.h"
#include "renderer/passes/draw/turn.h"
#include <math.h>
#include <sys/mman.h>

#define PIXELS_ON_GPU (1u << 24)
#define FIRST_PIXELS (1u << 12)
#define MOST_GROWTH 2.0
/* Of a software rasteriser's tiles; where a row of these takes too long, of a classifier's. */
#define TILE 64
#define LOW_ROWS 16
#define LEAST_ROWS 8
#define ROOM_STEP (4u << 20)
#define PAGE_BYTES 4096

static bool is_whole(const struct pass_pieces *p)
{
    return p->columns == p->width && p->rows == p->height;
}

static uint32_t at_most(uint32_t value, uint32_t most)
{
    return value < most ? value : most;
}

/* About so many pixels from where the piece at hand begins: bands of whole tiles, or parts of a low
 * band. */
static void cut(struct pass_pieces *p, double pixels)
{
    uint32_t down = p->height - p->y, across = p->width - p->x;
    double rows = fmin(pixels / p->width, 1 << 20);
    if (p->x == 0) {
        if (rows >= TILE)
            p->rows = (p->y + (uint32_t)rows) / TILE * TILE - p->y;
        else if (pixels >= TILE * LOW_ROWS)
            p->rows = rows >= LOW_ROWS ? (uint32_t)rows / LOW_ROWS * LOW_ROWS : LOW_ROWS;
        else
            p->rows = LEAST_ROWS;
        p->rows = at_most(p->rows, down);
    }
    double columns = fmin(fmax(pixels / p->rows, TILE), 1 << 20);
    p->columns = at_most((uint32_t)columns / TILE * TILE, across);
    if (p->columns >= 4 * TILE && across - p->columns < TILE)
        p->columns = across;
}

void pass_pieces_begin(struct technique_ctx *ctx, struct pass_pieces *pieces, uint32_t width,
    uint32_t height, uint64_t kind)
{
    *pieces = (struct pass_pieces){.width = width, .height = height, .kind = kind};
    pieces->columns = width, pieces->rows = height;
    pieces->since = gl_stopwatch_start();
    if (pass_turn_is_whole(ctx))
        return;
    double known = ctx->software ? pass_speed(ctx, kind)->ms : 0;
    cut(pieces, !ctx->software ? PIXELS_ON_GPU
                : known > 0    ? PASS_PIECE_SHARE * ctx->turns.most_ms / known
                               : FIRST_PIXELS);
}

void pass_pieces_aim(const struct pass_pieces *p)
{
    if (is_whole(p))
        return;
    gl.Enable(GL_SCISSOR_TEST);
    gl.Scissor((GLint)p->x, (GLint)p->y, (GLsizei)p->columns, (GLsizei)p->rows);
}

/* The piece at hand is drawn. Pixels that the next one should have. */
static double learn(struct technique_ctx *ctx, const struct pass_pieces *p, bool last)
{
    double pixels = (double)p->columns * p->rows;
    if (!ctx->software)
        return PIXELS_ON_GPU;
    pass_hand_over(ctx, p->kind, pixels, &p->since, last);
    double known = pass_speed(ctx, p->kind)->ms, most_ms = PASS_PIECE_SHARE * ctx->turns.most_ms;
    return known > 0 ? fmin(most_ms / known, MOST_GROWTH * pixels) : pixels;
}

bool pass_pieces_next(
    struct technique_ctx *ctx, struct pass_pieces *p, bool *more, struct pen_error *error)
{
    *more = false;
    if (is_whole(p)) {
        learn(ctx, p, true);
        return true;
    }
    gl.Disable(GL_SCISSOR_TEST);
    bool ends_row = p->x + p->columns == p->width;
    *more = !ends_row || p->y + p->rows < p->height;
    double pixels = learn(ctx, p, !*more);
    if (!*more)
        return true;
    p->x = ends_row ? 0 : p->x + p->columns;
    p->y += ends_row ? p->rows : 0;
    cut(p, pixels);
    if (!pass_turn(ctx, error))
        return false;
    p->since = gl_stopwatch_start();
    return true;
}

bool pass_room(struct technique_ctx *ctx, uint64_t bytes, struct pen_error *error)
{
    if (!ctx->software || pass_turn_is_whole(ctx) || bytes < 2 * ROOM_STEP)
        return true;
    if (!gl_textures_make_room(bytes)) /* what is touched here is there beside what is held */
        return pass_fits(ctx, error);
    char *room = mmap(
        NULL, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    if (room == MAP_FAILED)
        return true; /* whoever needs it will say so */
    madvise(room, bytes, MADV_HUGEPAGE);
    bool ok = true;
    for (uint64_t done = 0; ok && done < bytes; ok = pass_turn(ctx, error)) {
        uint64_t end = done + ROOM_STEP < bytes ? done + ROOM_STEP : bytes;
        for (; done < end; done += PAGE_BYTES)
            ((volatile char *)room)[done] = 1;
    }
    munmap(room, bytes);
    return ok;
}
