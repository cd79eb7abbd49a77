#include "renderer/lane.h"
#include "protocol/memory.h"
#include "renderer/passes/draw/passes.h"
#include "renderer/passes/draw/turn.h"
#include "renderer/passes/map/shadow_cache.h"
#include <stdlib.h>
#include <string.h>

static uint32_t technique_count(void)
{
    uint32_t count = 0;
    while (technique_registry[count])
        count++;
    return count;
}

bool lane_make(
    struct lane *lane, const struct technique_ctx *shared, uint32_t number, struct pen_error *error)
{
    if (lane->states)
        return true;
    lane->ctx = *shared;
    lane->ctx.lane = number;
    lane->ctx.passes = passes_create();
    lane->fiber = gl_fiber_create();
    gl_timer_init(&lane->ctx.timer, lane->ctx.software);
    gl.CreateBuffers(1, &lane->ctx.view_block);
    gl.CreateBuffers(1, &lane->ctx.light_block);
    gl.CreateBuffers(1, &lane->ctx.param_block);
    lane->states = pen_alloc_zero(technique_count(), sizeof *lane->states);
    for (uint32_t i = 0; technique_registry[i]; i++) {
        const struct technique *t = technique_registry[i];
        lane->states[i] = pen_alloc_zero(1, t->state_size);
        if (t->create && !t->create(&lane->ctx, lane->states[i], error)) {
            lane_finish(lane); /* else the next call would take it for made */
            return false;
        }
    }
    return true;
}

void lane_finish(struct lane *lane)
{
    if (!lane->states)
        return;
    for (uint32_t i = 0; technique_registry[i]; i++) {
        if (lane->states[i] && technique_registry[i]->destroy)
            technique_registry[i]->destroy(&lane->ctx, lane->states[i]);
        free(lane->states[i]);
    }
    free(lane->states);
    frame_targets_finish(&lane->targets);
    passes_destroy(lane->ctx.passes);
    gl_timer_finish(&lane->ctx.timer);
    GLuint buffers[] = {lane->ctx.view_block, lane->ctx.light_block, lane->ctx.param_block};
    gl.DeleteBuffers(3, buffers);
    gl_fiber_destroy(lane->fiber);
    memset(lane, 0, sizeof *lane);
}

static void run(void *context)
{
    struct lane *lane = context;
    lane->ok = frame_render(&lane->job, lane->frame, lane->result, &lane->error) &&
               pass_fits(&lane->ctx, &lane->error);
}

void lane_begin(struct lane *lane, struct gl_account *account, struct pen_frame *frame,
    struct pen_result *result)
{
    lane->busy = true;
    lane->charged = account;
    lane->ended = lane->ok = false;
    lane->frame = frame;
    lane->result = result;
    lane->error = (struct pen_error){0};
    lane->programs_since = gl_programs_clock(lane->ctx.programs);
    lane->ctx.turns = (struct technique_turns){.fiber = lane->fiber};
    gl_fiber_begin(lane->fiber, run, lane);
}

bool lane_advance(struct lane *lane, double ms)
{
    struct technique_turns *turns = &lane->ctx.turns;
    turns->most_ms = ms;
    turns->since_ms = gl_now_ms();
    struct gl_account *before = gl_textures_charge(lane->charged);
    lane->ended = gl_fiber_resume(lane->fiber);
    lane->charged = gl_textures_charge(before);
    if (!lane->ended)
        return false;
    while (turns->pieces)
        gl.DeleteSync(turns->under_way[--turns->pieces].fence);
    if (turns->fence)
        gl.DeleteSync(turns->fence);
    turns->fence = NULL;
    return true;
}

void lane_cancel(struct lane *lane)
{
    lane->ctx.turns.cancelled = true;
    lane_advance(lane, 0);
}
