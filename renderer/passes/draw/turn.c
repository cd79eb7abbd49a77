#include "renderer/passes/draw/turn.h"
#include <cglm/cglm.h>
#include <math.h>

#define BAND_PIXELS_ON_GPU (1u << 24)
#define BAND_ROWS                                                                                  \
    64 /* a multiple of a software rasteriser's tiles and of a shader's 2 x 2 pixels */

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

/* Nobody comes in between. */
static bool is_whole(const struct technique_turns *turns)
{
    return !turns->fiber || turns->held || isinf(turns->most_ms);
}

bool pass_turn(struct technique_ctx *ctx, struct pen_error *error)
{
    struct technique_turns *turns = &ctx->turns;
    if (is_whole(turns))
        return true;
    follow_device(ctx);
    double now = gl_now_ms();
    if (!turns->cancelled && now - turns->since_ms >= turns->most_ms) {
        turns->used_ms += now - turns->since_ms;
        gl_timer_stop(&ctx->timer);
        gl_fiber_pause(turns->fiber);
        gl_timer_go_on(&ctx->timer);
        turns->number++;
        turns->since_ms = gl_now_ms();
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
    if (!is_whole(&ctx->turns) && ctx->software)
        gl.Finish();
    return pass_turn(ctx, error);
}

void pass_bands_begin(struct technique_ctx *ctx, struct pass_bands *bands, uint32_t width,
    uint32_t height, uint32_t first_pixels)
{
    uint32_t pixels = ctx->software ? first_pixels : BAND_PIXELS_ON_GPU;
    uint32_t rows = pixels / width / BAND_ROWS * BAND_ROWS;
    *bands = (struct pass_bands){0, rows > BAND_ROWS ? rows : BAND_ROWS, height, width, 0};
    if (is_whole(&ctx->turns) || bands->rows > height)
        bands->rows = height;
    bands->since_ms = gl_now_ms();
}

void pass_bands_crop(const struct pass_bands *bands, float top, mat4 to_clip)
{
    /* In units of clip space, from the top: the middle and half the height of the band. */
    float half = (float)bands->rows / (float)bands->height;
    float middle = (2 * (float)bands->y + (float)bands->rows) / (float)bands->height - 1;
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
    if (bands->rows == bands->height) {
        *more = false;
        return true;
    }
    gl.Disable(GL_SCISSOR_TEST);
    bands->y += bands->rows;
    *more = bands->y < bands->height;
    if (!*more)
        return true;
    if (ctx->software) {
        gl.Finish();
        double ms = fmax(gl_now_ms() - bands->since_ms, 1e-3);
        double rows = fmin(bands->rows * ctx->turns.most_ms / ms, 8.0 * bands->rows);
        bands->rows = rows < BAND_ROWS ? BAND_ROWS : (uint32_t)rows / BAND_ROWS * BAND_ROWS;
    }
    uint32_t left = bands->height - bands->y;
    bands->rows = bands->rows < left ? bands->rows : left;
    if (!pass_turn(ctx, error))
        return false;
    bands->since_ms = gl_now_ms();
    return true;
}
