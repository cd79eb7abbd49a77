#include "server/workers/worker_slot.h"
#include "server/base/clock.h"
#include "server/base/log.h"
#include "server/workers/measured.h"
#include <poll.h>
#include <string.h>

/* One that finds no room is passed so often before others wait for it, and they do so for so long. */
#define MOST_PASSED 8
#define KEPT_FREE_NS (10 * CLOCK_S)
/* So many places are for those who want little, and so long a render may be for that. */
#define LAST_TURNS 2
#define SHORT_MS 500.0

void worker_slot_finish(struct slot *slot, struct flight *flight, const struct outcome *outcome)
{
    struct render *render = flight->render;
    flight->render = NULL;
    scheduler_finish(slot->pool->config.scheduler, render, outcome);
}

struct flight *worker_slot_find(struct slot *slot, uint64_t job)
{
    for (int i = 0; i < IN_FLIGHT; i++)
        if (slot->flights[i].render && slot->flights[i].render->id == job)
            return &slot->flights[i];
    return NULL;
}

static void on_hello(struct slot *slot, const struct channel_hello *hello)
{
    struct worker_pool *pool = slot->pool;
    double back_ms = slot->died_ns ? clock_ms(clock_now_ns() - slot->died_ns) : 0;
    slot->said_hello = true;
    slot->failures = 0;
    pthread_mutex_lock(&pool->lock);
    struct worker_pool_numbers *numbers = &pool->numbers;
    slot->programs = (struct pen_program_counts){0};
    numbers->has_device = true;
    numbers->warmed = numbers->warmed || !pool->config.warm_up;
    numbers->device = hello->device;
    pen_device_receive(&numbers->device);
    struct pen_device_info device = numbers->device;
    numbers->create_ms = hello->create_ms;
    numbers->up++;
    numbers->pids[slot->index] = (int)slot->process.pid;
    if (slot->died_ns)
        numbers->back_ms = back_ms;
    pthread_mutex_unlock(&pool->lock);
    log_event(LOG_INFO, "worker %u (pid %d) renders on %s (%s%s), context in %.0f ms%s%.0f%s",
        slot->index, (int)slot->process.pid, device.renderer, device.platform,
        device.software ? ", software" : "", hello->create_ms,
        slot->died_ns ? ", back after " : ", up after ",
        slot->died_ns ? back_ms : clock_ms(clock_now_ns() - slot->spawned_ns), " ms");
}

static void on_refused(struct slot *slot, struct pen_error refused)
{
    pen_error_receive(&refused);
    log_event(LOG_ERROR, "worker %u: %s", slot->index, refused.message);
    pthread_mutex_lock(&slot->pool->lock);
    if (!slot->pool->numbers.has_device)
        slot->pool->numbers.refused = refused;
    pthread_mutex_unlock(&slot->pool->lock);
}

static void on_warm(struct slot *slot, const struct channel_warm *warm)
{
    struct worker_pool *pool = slot->pool;
    pthread_mutex_lock(&pool->lock);
    pool->numbers.warmed = true;
    pool->numbers.warm_ms = warm->warm_ms;
    pool->numbers.gpu_bytes = warm->gpu_bytes;
    slot->programs = warm->programs;
    pthread_mutex_unlock(&pool->lock);
    log_event(LOG_INFO, "worker %u warmed up in %.0f ms: %u programs, about %.0f MiB", slot->index,
        warm->warm_ms, warm->programs.kept, (double)warm->programs.bytes / (1 << 20));
}

/* Says in the log when programs begin to leave, and each time as many have left as are kept: then
 * requests differ in more ways than there is room for, and pay for their compiles. */
static void take_programs(struct slot *slot, const struct pen_program_counts *now)
{
    pthread_mutex_lock(&slot->pool->lock);
    uint32_t before = slot->programs.evicted;
    slot->programs = *now;
    pthread_mutex_unlock(&slot->pool->lock);
    uint32_t step = now->kept ? now->kept : 1;
    if ((now->evicted && !before) || now->evicted / step != before / step)
        log_event(LOG_INFO,
            "worker %u keeps %u programs, about %.0f MiB; of %u compiled, %u have left",
            slot->index, now->kept, (double)now->bytes / (1 << 20), now->compiled, now->evicted);
}

static void on_done(
    struct slot *slot, const struct channel_message *message, const struct channel_fds *fds)
{
    struct worker_pool *pool = slot->pool;
    struct flight *flight = worker_slot_find(slot, message->job);
    if (!flight)
        return;
    struct pen_result result = message->result;
    struct outcome outcome = {.error = result.error};
    result.stage_ms[PEN_STAGE_QUEUE] =
        (float)clock_ms(flight->render->taken_ns - flight->render->queued_ns);
    pthread_mutex_lock(&pool->lock);
    pool->numbers.gpu_bytes = result.gpu_bytes;
    pthread_mutex_unlock(&pool->lock);
    take_programs(slot, &result.programs);
    result.estimate_ms = flight->render->estimate.ms;
    outcome.result = &result;
    if (outcome.error.code == PEN_OK && flight->render->measure != MEASURE_PICTURE) {
        measured_take(flight->render->measure, fds, &outcome);
        pool->config.on_measured(pool->config.context, &result);
    } else if (outcome.error.code == PEN_OK) {
        char tag[PEN_ID_HEX + 1];
        picture_tag(&flight->render->request, &result.device, tag);
        /* One that had to end early, or rests on others, is not what the request stands for. */
        bool complete = result.progress.done >= result.progress.total &&
                        !flight->render->request.delivery.session[0];
        outcome.picture = fds->count == 1 ? picture_create(fds->fd[0], &result,
                                                complete ? tag : NULL, &outcome.error)
                                          : NULL;
        if (!outcome.picture)
            pen_fail(&outcome.error, PEN_INTERNAL, "", "The worker handed over no image.");
        else
            pool->config.on_picture(pool->config.context, outcome.picture);
    }
    worker_slot_finish(slot, flight, &outcome);
    measured_release(&outcome);
}

static bool is_in_turns(const struct flight *flight)
{
    return flight->render && flight->phase != PHASE_ENCODING;
}

/* The scene cannot be in two poses, or dressed in two ways, at a time. */
static bool is_posed_alike(const struct pen_request *a, const struct pen_request *b)
{
    return a->time_s == b->time_s && !strcmp(a->animation, b->animation) &&
           !strcmp(a->variant, b->variant);
}

/* One that would have fitted if others had not gone before it. */
static enum take pass(struct slot *slot, struct render *render)
{
    if (render->passed < MOST_PASSED)
        return TAKE_LATER;
    uint64_t now = clock_now_ns();
    if (slot->kept_free_for != render->id) {
        slot->kept_free_for = render->id;
        slot->kept_free_ns = now;
    }
    if (now - slot->kept_free_ns < KEPT_FREE_NS)
        return TAKE_NOTHING;
    slot->kept_free_for = 0; /* what is in the way takes long: that is not for others to bear */
    render->passed = 0;
    return TAKE_LATER;
}

/* Whatever takes long leaves the last places to others: batches, what is known to take long, and
 * what comes from a client who has one already. */
static bool may_have_last(const struct slot *slot, const struct render *render)
{
    const struct estimate *estimate = &render->estimate;
    if (render->batch || (estimate->ms > 0 && estimate->sure * estimate->ms > SHORT_MS))
        return false;
    for (int i = 0; i < IN_FLIGHT; i++) {
        const struct render *other = slot->flights[i].render;
        if (is_in_turns(&slot->flights[i]) && !other->batch && other->payer == render->payer)
            return false;
    }
    return true;
}

/* Comparisons of one client are done one after the other: side by side they would all be late
 * together, and disturb each other's times. */
static bool is_beside_its_own(const struct render *render, const struct render *other)
{
    return render->measure != MEASURE_PICTURE && other->measure != MEASURE_PICTURE &&
           render->payer == other->payer;
}

enum take worker_slot_fits(void *context, struct render *render)
{
    struct slot *slot = context;
    uint32_t count = 0;
    if (homes_is_away(slot->pool->homes, render, slot->index, clock_now_ns()))
        return TAKE_LATER;
    for (int i = 0; i < IN_FLIGHT; i++) {
        if (slot->flights[i].render && is_beside_its_own(render, slot->flights[i].render))
            return TAKE_LATER;
        if (!is_in_turns(&slot->flights[i]))
            continue;
        const struct pen_request *other = &slot->flights[i].render->request;
        if (!memcmp(other->scene, render->request.scene, PEN_ID_BYTES) &&
            !is_posed_alike(other, &render->request))
            return TAKE_SCENE_LATER;
        count++;
    }
    if (count == IN_TURNS)
        return TAKE_NOTHING;
    uint32_t kept = render->passed < MOST_PASSED ? LAST_TURNS : 1;
    if (count >= IN_TURNS - kept && !may_have_last(slot, render))
        return TAKE_LATER;
    bool was_busy = count && render->busy_worker == slot->index + 1;
    return was_busy && render->busy_ended == slot->ended ? pass(slot, render) : TAKE_FITS;
}

/* There was no room for it: it goes back, until something has ended. */
static void on_busy(struct slot *slot, struct flight *flight)
{
    struct render *render = flight->render;
    render->busy_worker = slot->index + 1;
    render->busy_ended = slot->ended;
    flight->render = NULL;
    slot->turn_job = 0;
    slot->turning = false;
    scheduler_return(slot->pool->config.scheduler, render);
}

#define FORGET_SILENCE 0.998 /* per sign of life */

static void hear_life(struct slot *slot)
{
    uint64_t now = clock_now_ns(), silence = now - slot->heard_ns;
    bool works = slot->turning;
    uint64_t forgotten = (uint64_t)(FORGET_SILENCE * (double)slot->silence_ns);
    if (works)
        slot->silence_ns = silence > forgotten ? silence : forgotten;
    slot->heard_ns = now;
}

/* A picture so far. */
static void on_part(
    struct slot *slot, const struct channel_message *message, const struct channel_fds *fds)
{
    struct flight *flight = worker_slot_find(slot, message->job);
    struct pen_result result = message->result;
    struct pen_error error = {0};
    if (!flight)
        return;
    flight->part_wanted = false;
    result.stage_ms[PEN_STAGE_QUEUE] =
        (float)clock_ms(flight->render->taken_ns - flight->render->queued_ns);
    struct picture *picture =
        fds->count == 1 ? picture_create(fds->fd[0], &result, NULL, &error) : NULL;
    if (picture)
        scheduler_show_part(slot->pool->config.scheduler, flight->render, picture);
    picture_release(picture);
}

/* False when the worker is to be buried. */
static bool on_message(
    struct slot *slot, struct channel_message *message, const struct channel_fds *fds)
{
    struct flight *flight = worker_slot_find(slot, message->job);
    slot->alive_ns = clock_now_ns();
    if (message->kind == CHANNEL_ALIVE)
        return true;
    hear_life(slot);
    switch (message->kind) {
    case CHANNEL_HELLO:
        if (!slot->said_hello)
            on_hello(slot, &message->hello);
        return true;
    case CHANNEL_REFUSED:
        on_refused(slot, message->refused);
        return false;
    case CHANNEL_WARM:
        on_warm(slot, &message->warm);
        return true;
    case CHANNEL_TURN:
        slot->turn_job = message->job;
        slot->turning = true;
        slot->turn_place = message->turn.place;
        slot->turn_place.pass[sizeof slot->turn_place.pass - 1] = 0;
        return true;
    case CHANNEL_BUSY:
        if (flight)
            on_busy(slot, flight);
        return true;
    case CHANNEL_STARTED:
    case CHANNEL_RENDERED:
        slot->ended += message->kind == CHANNEL_RENDERED;
        slot->turn_job = message->kind == CHANNEL_STARTED ? message->job : 0;
        slot->turning = false;
        memset(&slot->turn_place, 0, sizeof slot->turn_place);
        if (flight) {
            flight->phase = message->kind == CHANNEL_STARTED ? PHASE_RENDERING : PHASE_ENCODING;
            flight->since_ns = clock_now_ns();
        }
        return true;
    case CHANNEL_RESIDENT:
        pthread_mutex_lock(&slot->pool->lock);
        slot->resident = message->resident;
        if (slot->resident.count > CHANNEL_MAX_RESIDENT)
            slot->resident.count = 0;
        pthread_mutex_unlock(&slot->pool->lock);
        return true;
    case CHANNEL_PART:
    case CHANNEL_DONE:
        if (!pen_result_receive(&message->result, slot->pool->config.catalogue))
            return false;
        if (message->kind == CHANNEL_PART)
            on_part(slot, message, fds);
        else
            on_done(slot, message, fds);
        return true;
    default:
        return false;
    }
}

bool worker_slot_hear(struct slot *slot)
{
    struct channel_message message;
    struct channel_fds fds;
    for (;;) {
        struct pollfd watch = {slot->socket, POLLIN, 0};
        if (poll(&watch, 1, 0) <= 0)
            return true;
        int got = channel_receive(slot->socket, &message, &fds);
        if (got <= 0)
            return false;
        bool ok = on_message(slot, &message, &fds);
        channel_close_fds(&fds);
        if (!ok)
            return false;
    }
}
