#include "renderer/passes/draw/turn.h"
#include <cglm/cglm.h>
#include <math.h>
#include <string.h>

#define BAND_PIXELS_ON_GPU (1u << 24)
#define BAND_ROWS 64 /* of a software rasteriser's tiles */
/* Work of the pieces of a drawing, see cull_piece: as long as its speed is not known, what is not worth
 * another wait, and what a GPU does without being watched. */
#define FIRST_WORK (1u << 22)
#define LEAST_WORK (1u << 20)
#define WORK_ON_GPU (1ull << 35)
/* Of unlike pieces, and not everything that a pass draws costs the same, the slowest counts, and is forgotten
 * slowly. */
#define REMEMBERED 0.97
#define NEIGHBOURS 16 /* places where a kind's speed may be */

/* Waits until what was handed over before the last call is done, so that no more than two pieces are
 * ever under way: elsewhere than on a CPU, time passes on the device. */
static void follow_device(struct technique_ctx *ctx)
{
    struct technique_turns *turns = &ctx->turns;
    if (ctx->software)
        return; /* its timer has waited */
    if (turns->fence) {
        gl.ClientWaitSync(turns->fence, GL_SYNC_FLUSH_COMMANDS_BIT, UINT64_MAX);
        gl.DeleteSync(turns->fence);
    }
    turns->fence = gl.FenceSync(GL_SYNC_GPU_COMMANDS_COMPLETE, 0);
}

void pass_bind_counts(struct technique_ctx *ctx, GLuint buffer)
{
    ctx->counts = buffer;
    if (buffer)
        gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, STORAGE_COUNTS, buffer);
}

bool pass_turn_is_whole(const struct technique_ctx *ctx)
{
    const struct technique_turns *turns = &ctx->turns;
    return !turns->fiber || turns->held || isinf(turns->most_ms);
}

static bool is_time_up(const struct technique_turns *turns)
{
    double now = gl_now_ms(), used = turns->used_ms + now - turns->since_ms;
    return (turns->stop_ms > 0 && now > turns->stop_ms) ||
           (turns->stop_used_ms > 0 && used > turns->stop_used_ms);
}

/* Another piece like the last one would not end in time, or somebody calls. */
static bool is_over(struct technique_ctx *ctx, double now)
{
    struct technique_turns *turns = &ctx->turns;
    double last = now - fmax(turns->piece_ms, turns->since_ms);
    turns->piece_ms = now;
    return now + last - turns->since_ms >= turns->most_ms ||
           (ctx->is_called && ctx->is_called(ctx->call_context));
}

bool pass_fits(const struct technique_ctx *ctx, struct pen_error *error)
{
    const struct technique_turns *turns = &ctx->turns;
    return !turns->needed_bytes || turns->held ||
           pen_fail(error, PEN_TOO_BIG, "",
               "With this method's maps the image needs more than %.0f MiB of GPU memory; %.0f MiB "
               "are allowed. Ask for smaller or fewer maps (map_size), or have --gpu-memory "
               "raised.",
               (double)turns->needed_bytes / (1 << 20), (double)ctx->gpu_memory / (1 << 20));
}

bool pass_turn(struct technique_ctx *ctx, struct pen_error *error)
{
    struct technique_turns *turns = &ctx->turns;
    turns->stopped |= !turns->held && is_time_up(turns);
    if (turns->stopped)
        return pen_fail(error, PEN_DEADLINE, "/deadline_ms", "The image's time is up.");
    if (!pass_fits(ctx, error))
        return false;
    if (pass_turn_is_whole(ctx))
        return true;
    follow_device(ctx);
    double now = gl_now_ms();
    if (!turns->cancelled && is_over(ctx, now)) {
        turns->used_ms += now - turns->since_ms;
        gl_timer_stop(&ctx->timer);
        if (turns->away)
            turns->away(turns->away_context, true);
        gl_fiber_pause(turns->fiber);
        if (turns->away)
            turns->away(turns->away_context, false);
        gl_timer_go_on(&ctx->timer);
        turns->number++;
        turns->since_ms = gl_now_ms();
        turns->away_ms += turns->since_ms - ctx->timer.stopped_ms;
        gl.BindBufferBase(GL_UNIFORM_BUFFER, UBO_VIEW, ctx->view_block);
        gl.BindBufferBase(GL_UNIFORM_BUFFER, UBO_LIGHT, ctx->light_block);
        gl.BindBufferBase(GL_UNIFORM_BUFFER, UBO_PARAMS, ctx->param_block);
        pass_bind_counts(ctx, ctx->counts);
    }
    return !turns->cancelled ||
           pen_fail(error, PEN_LOST, "", "Nobody waits for this image any more.");
}

bool pass_turn_inside(struct technique_ctx *ctx, struct pen_error *error)
{
    if (!pass_turn_is_whole(ctx) && ctx->software)
        gl_wait();
    return pass_turn(ctx, error);
}

static uint32_t whole_rows(double rows)
{
    return (uint32_t)fmin(fmax(rows, BAND_ROWS), 1 << 20) / BAND_ROWS * BAND_ROWS;
}

struct technique_speed *pass_speed(struct technique_ctx *ctx, uint64_t kind)
{
    struct technique_speed *first = &ctx->speeds[kind % TECHNIQUE_SPEEDS], *free = NULL;
    for (uint32_t i = 0; i < NEIGHBOURS; i++) {
        struct technique_speed *speed = &ctx->speeds[(kind + i) % TECHNIQUE_SPEEDS];
        if (speed->kind == kind)
            return speed;
        free = !free && !speed->kind ? speed : free;
    }
    free = free ? free : first;
    *free = (struct technique_speed){.kind = kind};
    return free;
}

static void begin_piece(struct pass_bands *bands)
{
    bands->piece.pixels = (double)bands->rows * bands->width;
    bands->piece.work = 0;
    bands->since = gl_stopwatch_start();
}

void pass_bands_begin(struct technique_ctx *ctx, struct pass_bands *bands, uint32_t width,
    uint32_t height, uint32_t first_pixels, uint64_t kind)
{
    uint32_t pixels = ctx->software ? first_pixels : BAND_PIXELS_ON_GPU;
    *bands = (struct pass_bands){
        .rows = whole_rows((double)pixels / width), .height = height, .width = width, .kind = kind};
    double known = ctx->software ? pass_speed(ctx, kind)->ms : 0;
    if (pass_turn_is_whole(ctx) || bands->rows > height)
        bands->rows = height;
    bands->piece.most = pass_turn_is_whole(ctx) ? INFINITY
                        : !ctx->software        ? (double)WORK_ON_GPU
                        : known > 0
                            ? fmax(PASS_PIECE_SHARE * ctx->turns.most_ms / known, LEAST_WORK)
                            : FIRST_WORK;
    begin_piece(bands);
}

/* Until the first of what is under way is done. As pass_hand_over. */
static double catch_up(struct technique_ctx *ctx)
{
    struct technique_turns *turns = &ctx->turns;
    struct technique_piece piece = turns->under_way[0], *next = turns->under_way;
    gl.ClientWaitSync(piece.fence, GL_SYNC_FLUSH_COMMANDS_BIT, UINT64_MAX);
    gl.DeleteSync(piece.fence);
    turns->pieces--;
    memmove(next, next + 1, turns->pieces * sizeof *next);
    if (turns->pieces && next->follows) {
        next->since = gl_stopwatch_start();
        next->away_ms = turns->away_ms;
    }
    if (piece.waits != gl_waits() || piece.units < 0)
        return 0;
    double ms = fmax(gl_stopwatch_ms(&piece.since) - (turns->away_ms - piece.away_ms), 1e-3);
    if (piece.units > 0) {
        struct technique_speed *speed = pass_speed(ctx, piece.kind);
        speed->ms = fmax(ms / piece.units, REMEMBERED * speed->ms);
    }
    return ms;
}

double pass_hand_over(struct technique_ctx *ctx, uint64_t kind, double units,
    const struct gl_stopwatch *since, bool wait)
{
    struct technique_turns *turns = &ctx->turns;
    if (!ctx->software || pass_turn_is_whole(ctx))
        return 0;
    struct technique_piece piece = {.fence = gl.FenceSync(GL_SYNC_GPU_COMMANDS_COMPLETE, 0),
        .kind = kind,
        .units = units,
        .waits = gl_waits(),
        .away_ms = turns->away_ms,
        .since = *since};
    const struct technique_piece *before = turns->under_way + turns->pieces - 1;
    piece.follows = turns->pieces && before->waits == piece.waits;
    wait |= units > 0 && pass_speed(ctx, kind)->ms == 0;
    if (!piece.follows && !wait)
        piece.units = -1; /* it ends unseen while the next one is handed over */
    turns->under_way[turns->pieces++] = piece;
    double ms = 0;
    while (turns->pieces == TECHNIQUE_PIECES || (wait && turns->pieces))
        ms = catch_up(ctx);
    return ms;
}

/* The piece at hand is drawn: learns how long such pieces take, and how much is to be drawn at once from
 * here on. */
static void learn(struct technique_ctx *ctx, struct pass_bands *bands)
{
    struct cull_piece *piece = &bands->piece;
    bool first = bands->slowest_ms == 0;
    double most_ms = PASS_PIECE_SHARE * ctx->turns.most_ms;
    double units = piece->compiles            ? -1
                   : piece->work > LEAST_WORK ? piece->work
                                              : 0; /* what is less tells little */
    double ms = pass_hand_over(ctx, bands->kind, units, &bands->since, bands->by_hand);
    bands->slowest_ms = fmax(bands->slowest_ms, ms);
    double known = pass_speed(ctx, bands->kind)->ms;
    if (known > 0)
        piece->most = fmax(fmin(most_ms / known, 4 * piece->most), LEAST_WORK);
    if (piece->more || bands->slowest_ms == 0)
        return;
    /* Where there are several pieces, rows count only if one triangle is too much. */
    double fit = most_ms / bands->slowest_ms;
    if (first || fit < 0.5)
        bands->rows = whole_rows(bands->rows * fmin(fit, 2));
    bands->slowest_ms = 0;
}

void pass_bands_crop(
    const struct pass_bands *bands, float top, uint32_t first, uint32_t height, mat4 to_clip)
{
    /* In units of clip space, from the top: the middle and half the height of the band. */
    float half = (float)bands->rows / (float)height;
    float middle = (2 * (float)(first + bands->y) + (float)bands->rows) / (float)height - 1;
    for (int column = 0; column < 4; column++)
        to_clip[column][1] = (to_clip[column][1] + top * middle * to_clip[column][3]) / half;
}

void pass_bands_aim(const struct pass_bands *bands)
{
    if (bands->rows == bands->height)
        return;
    gl.Enable(GL_SCISSOR_TEST);
    gl.Scissor(0, (GLint)bands->y, (GLsizei)bands->width, (GLsizei)bands->rows);
}

bool pass_bands_next(
    struct technique_ctx *ctx, struct pass_bands *bands, bool *more, struct pen_error *error)
{
    struct cull_piece *piece = &bands->piece;
    uint32_t below = bands->y + bands->rows;
    *more = piece->more || below < bands->height;
    if (bands->rows != bands->height)
        gl.Disable(GL_SCISSOR_TEST);
    if (ctx->software && !pass_turn_is_whole(ctx))
        learn(ctx, bands);
    if (!*more)
        return true;
    if (!piece->more) {
        uint32_t left = bands->height - below;
        bands->y = below;
        bands->rows = bands->rows < left ? bands->rows : left;
        *piece = (struct cull_piece){.most = piece->most};
    }
    if (!pass_turn(ctx, error))
        return false;
    begin_piece(bands);
    return true;
}
