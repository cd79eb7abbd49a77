#include "server/workers/worker_pool.h"
#include "protocol/memory.h"
#include "server/base/clock.h"
#include "server/base/log.h"
#include "server/workers/quarantine.h"
#include "server/workers/worker_slot.h"
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <pthread.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#define WANTED_EVERY_MS 10 /* how often it is asked whether anybody still waits for what runs */
#define MAX_KILLS 2        /* of one render, by its own fault */
#define STARVED_RETRY_S 10
#define MAX_STARVED 2  /* of one render, when memory runs out */
#define MAX_ATTEMPTS 6 /* of one render, when somebody else ends the workers */
#define QUIT_MS 3000
#define MAX_BACKOFF_MS 5000
#define LEAST_PATIENCE_NS (10 * CLOCK_S)
#define SILENCES 120
#define START_PATIENCE_NS (120 * CLOCK_S)
#define SILENT_NS (2 * CLOCK_S) /* four heartbeats */
#define OWN_SLEEP_NS (1500 * CLOCK_MS)
#define FILL_PATIENCE_NS (1800 * CLOCK_S)

static bool is_stopping(const struct worker_pool *pool)
{
    return __atomic_load_n(&pool->stopping, __ATOMIC_ACQUIRE);
}

static bool start(const struct slot *slot, struct process *process, enum worker_warm_up what,
    const struct process_fd *fd, struct pen_error *error)
{
    const struct pen_renderer_config *renderer = &slot->pool->config.renderer;
    char device[24], index[24], gpu[4], debug[4], memory[24], warm[4];
    snprintf(device, sizeof device, "%u", renderer->device.choice);
    snprintf(index, sizeof index, "%u", renderer->device.index + slot->index);
    snprintf(gpu, sizeof gpu, "%d", renderer->device.require_gpu);
    snprintf(debug, sizeof debug, "%d", renderer->device.debug);
    snprintf(memory, sizeof memory, "%llu", (unsigned long long)renderer->gpu_memory_bytes);
    snprintf(warm, sizeof warm, "%d", what);
    char *arguments[] = {"penumbra-worker", "--device", device, "--device-index", index,
        "--require-gpu", gpu, "--gl-debug", debug, "--gpu-memory", memory, "--warm-up", warm, NULL};
    return process_start(process, slot->pool->config.worker_path, arguments, fd, fd != NULL, error);
}

static void spawn(struct slot *slot)
{
    struct worker_pool *pool = slot->pool;
    int pair[2];
    slot->spawned_ns = clock_now_ns();
    slot->said_hello = slot->hung = false;
    slot->turn_job = 0;
    slot->turning = false;
    slot->heard_ns = slot->alive_ns = slot->looked_ns = slot->spawned_ns;
    slot->silence_ns = 0;
    if (socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, pair)) {
        slot->failures++;
        return;
    }
    /* One that replaces another has work waiting. */
    pthread_mutex_lock(&pool->lock);
    enum worker_warm_up what =
        pool->numbers.warmed || !pool->config.warm_up ? WORKER_NO_WARM_UP : WORKER_WARM_UP_USUAL;
    pthread_mutex_unlock(&pool->lock);
    struct pen_error error = {0};
    if (start(
            slot, &slot->process, what, &(struct process_fd){pair[1], CHANNEL_WORKER_FD}, &error)) {
        slot->socket = pair[0];
    } else {
        log_event(LOG_ERROR, "worker %u could not be started: %s", slot->index, error.message);
        slot->failures++;
        close(pair[0]);
    }
    close(pair[1]);
}

/* Once a worker is ready, a process of its own compiles the rest into the driver's cache, so that no
 * request waits for a compile that is not its own. Nothing depends on it. */
static void look_after_cache(struct slot *slot)
{
    struct worker_pool *pool = slot->pool;
    struct pen_error error = {0};
    int status;
    char text[64];
    if (!pool->filler_ns) {
        pthread_mutex_lock(&pool->lock);
        bool now = pool->config.warm_up && pool->numbers.warmed;
        pthread_mutex_unlock(&pool->lock);
        if (!now)
            return;
        pool->filler_ns = clock_now_ns();
        if (!start(slot, &pool->filler, WORKER_WARM_UP_FILL, NULL, &error))
            log_event(LOG_ERROR, "the shader cache is not filled: %s", error.message);
        return;
    }
    if (!pool->filler.pid)
        return;
    uint64_t took = clock_now_ns() - pool->filler_ns;
    if (took > FILL_PATIENCE_NS)
        process_signal(&pool->filler, SIGKILL);
    if (!process_wait(&pool->filler, 0, &status))
        return;
    if (status) {
        log_event(LOG_ERROR, "filling the shader cache %s after %.0f ms",
            process_describe(status, text, sizeof text), clock_ms(took));
        return;
    }
    pthread_mutex_lock(&pool->lock);
    pool->numbers.cache_ms = clock_ms(took);
    pthread_mutex_unlock(&pool->lock);
    log_event(LOG_INFO, "the shader cache was filled in %.0f ms", clock_ms(took));
}

static void count(struct worker_pool *pool, uint32_t *number)
{
    pthread_mutex_lock(&pool->lock);
    ++*number;
    pthread_mutex_unlock(&pool->lock);
}

static void blame(struct worker_pool *pool, const struct pen_request *request)
{
    char scene[PEN_ID_HEX + 1];
    pen_id_to_hex(request->scene, scene);
    switch (quarantine_blame(pool->quarantine, request)) {
    case QUARANTINE_REQUEST:
        log_event(LOG_ERROR,
            "scene %s, %.31s, %u x %u x %u ended two workers and is refused from now on", scene,
            request->technique, request->width, request->height, request->antialias);
        break;
    case QUARANTINE_SCENE:
        log_event(LOG_ERROR, "scene %s ended several workers and is refused from now on", scene);
        break;
    case QUARANTINE_NOTHING:
        break;
    }
}

/* Of what a worker has died. */
enum death { DEATH_OWN, DEATH_OUTSIDE, DEATH_MEMORY };

/* The worker died under this render: gives it back to be tried again, or gives up on it. */
static void survive(struct slot *slot, struct flight *flight, bool guilty, enum death death)
{
    struct worker_pool *pool = slot->pool;
    struct render *render = flight->render;
    struct outcome outcome = {0};
    render->attempts += flight->phase != PHASE_SENT;
    render->kills += guilty && death == DEATH_OWN;
    render->starved += guilty && death == DEATH_MEMORY;
    bool starved = render->starved >= MAX_STARVED;
    bool give_up = starved || render->kills >= MAX_KILLS || render->attempts >= MAX_ATTEMPTS;
    /* For what ends workers, not for what takes them long. */
    if (guilty && death == DEATH_OWN && !slot->hung)
        blame(pool, &render->request);
    if (is_stopping(pool)) {
        pen_fail(&outcome.error, PEN_UNAVAILABLE, "", "The service is shutting down.");
        worker_slot_finish(slot, flight, &outcome);
    } else if (starved) {
        pen_fail(&outcome.error, PEN_UNAVAILABLE, "",
            "Memory ran out twice while this was rendered, the device's or the machine's; other "
            "programs may hold it, or --gpu-memory is more than there is.");
        outcome.error.retry_after_s = STARVED_RETRY_S;
        worker_slot_finish(slot, flight, &outcome);
    } else if (give_up) {
        pen_fail(&outcome.error, PEN_INTERNAL, "", "Rendering this scene ends the renderer.");
        worker_slot_finish(slot, flight, &outcome);
    } else {
        count(pool, &pool->numbers.retries);
        flight->render = NULL;
        scheduler_return(pool->config.scheduler, render);
    }
}

static void log_suspect(const struct slot *slot, const struct render *render)
{
    const struct pen_place *at = &slot->turn_place;
    const struct pen_request *r = &render->request;
    char scene[PEN_ID_HEX + 1];
    pen_id_to_hex(r->scene, scene);
    log_event(LOG_ERROR,
        "it was at work on render %llu: scene %s, request %s, %.31s, %u x %u x %u, %u lights; "
        "turn %u began in frame %u, light %u, after \"%s\"",
        (unsigned long long)render->id, scene, *render->request_id ? render->request_id : "-",
        r->technique, r->width, r->height, r->antialias, r->light_count, at->turn, at->frame,
        at->light, at->pass);
}

static enum death find_cause(int status, bool hung)
{
    if (WIFSIGNALED(status) && !hung) /* no render stops a process */
        return WTERMSIG(status) == SIGKILL || WTERMSIG(status) == SIGTERM ? DEATH_OUTSIDE
                                                                          : DEATH_OWN;
    if (WIFEXITED(status) && WEXITSTATUS(status) == WORKER_EXIT_OTHERS)
        return DEATH_OUTSIDE;
    return WIFEXITED(status) && WEXITSTATUS(status) == WORKER_EXIT_MEMORY ? DEATH_MEMORY
                                                                          : DEATH_OWN;
}

static const char *death_text(int status, enum death death, char *text, size_t bytes)
{
    if (death == DEATH_MEMORY)
        return "ended: no memory is left to it or the device";
    if (death == DEATH_OUTSIDE && WIFEXITED(status))
        return "ended: another program made the device reset";
    return process_describe(status, text, bytes);
}

/* The process has ended, or its socket has: collects it and settles what it had in hand. */
static void bury(struct slot *slot)
{
    struct worker_pool *pool = slot->pool;
    int status;
    char text[64];
    if (slot->socket >= 0)
        close(slot->socket);
    slot->socket = -1;
    if (!process_wait(&slot->process, 0, &status)) {
        /* Hung up or talks nonsense, or hangs: it has no say any more. */
        process_signal(&slot->process, SIGKILL);
        process_wait(&slot->process, -1, &status);
    }
    slot->died_ns = clock_now_ns();
    enum death death = slot->silent ? DEATH_OUTSIDE : find_cause(status, slot->hung);
    const struct flight *suspect = worker_slot_find(slot, slot->turn_job);
    if (suspect && suspect->phase != PHASE_RENDERING)
        suspect = NULL;
    if (!is_stopping(pool)) {
        log_event(LOG_ERROR, "worker %u %s%s", slot->index, slot->hung ? "hung and " : "",
            death_text(status, death, text, sizeof text));
        if (suspect)
            log_suspect(slot, suspect->render);
        pthread_mutex_lock(&pool->lock);
        pool->numbers.restarts++;
        pool->numbers.hangs += slot->hung;
        pool->numbers.crashes += !slot->hung && death == DEATH_OWN;
        pool->numbers.starved += death == DEATH_MEMORY;
        pool->numbers.up -= slot->said_hello;
        pool->numbers.silent -= slot->silent;
        slot->silent = false;
        pool->numbers.pids[slot->index] = 0;
        pthread_mutex_unlock(&pool->lock);
    }
    pthread_mutex_lock(&pool->lock);
    slot->resident.count = 0;
    pthread_mutex_unlock(&pool->lock);
    homes_forget(pool->homes, slot->index);
    slot->failures = slot->said_hello ? 0 : slot->failures + 1;
    slot->is_replacement = true;
    for (int i = 0; i < IN_FLIGHT; i++) {
        struct flight *flight = &slot->flights[i];
        if (!flight->render)
            continue;
        /* Who had the turn, or, with nobody at work, what was encoded. */
        bool guilty =
            suspect ? flight == suspect
                    : flight->phase == (death == DEATH_MEMORY ? PHASE_RENDERING : PHASE_ENCODING);
        survive(slot, flight, guilty, death);
    }
}

/* Sends one render; false when the worker is to be buried. */
static bool dispatch(struct slot *slot, struct flight *flight, struct render *render)
{
    struct worker_pool *pool = slot->pool;
    struct channel_message message = {CHANNEL_VERSION, CHANNEL_JOB, render->id};
    struct channel_fds fds = {0};
    struct outcome outcome = {0};
    flight->render = render;
    slot->place = render->place;
    homes_take(pool->homes, render, slot->index, clock_now_ns());
    flight->phase = PHASE_SENT;
    flight->cancelled = flight->part_wanted = false;
    flight->since_ns = clock_now_ns();
    message.job_data.request = render->request;
    message.job_data.measure = render->measure;
    message.job_data.fresh = render->fresh;
    message.job_data.client = render->payer;
    message.job_data.best_until_ns = render->best_until_ns;
    struct pen_delivery *delivery = &message.job_data.request.delivery;
    memcpy(delivery->session_owner, &render->payer, sizeof render->payer);
    if (render->measure != MEASURE_PICTURE) /* what is compared stands for itself */
        memset(delivery->session, 0, sizeof delivery->session);
    if (!pool->config.open_job(pool->config.context, &message.job_data, &fds, &outcome.error)) {
        channel_close_fds(&fds);
        worker_slot_finish(slot, flight, &outcome);
        return true;
    }
    int reference = render->reference_fd > 0 ? fcntl(render->reference_fd, F_DUPFD_CLOEXEC, 3) : -1;
    if (reference >= 0)
        fds.fd[fds.count++] = reference;
    bool ok = channel_send(slot->socket, &message, &fds);
    channel_close_fds(&fds);
    return ok;
}

static bool feed(struct slot *slot)
{
    struct worker_pool *pool = slot->pool;
    uint8_t drops[MAX_DROPS][PEN_ID_BYTES];
    pthread_mutex_lock(&pool->lock);
    uint32_t drop_count = slot->drop_count;
    memcpy(drops, slot->drops, drop_count * sizeof *drops);
    slot->drop_count = 0;
    pthread_mutex_unlock(&pool->lock);
    for (uint32_t i = 0; i < drop_count; i++) {
        struct channel_message message = {CHANNEL_VERSION, CHANNEL_DROP, 0};
        memcpy(message.drop.scene, drops[i], PEN_ID_BYTES);
        if (!channel_send(slot->socket, &message, NULL))
            return false;
    }
    for (int i = 0; i < IN_FLIGHT; i++) {
        while (!slot->flights[i].render) {
            struct render *render = scheduler_take(
                pool->config.scheduler, &(struct taker){worker_slot_fits, slot, slot->place});
            if (!render)
                return true;
            if (!dispatch(slot, &slot->flights[i], render))
                return false;
        }
    }
    return true;
}

/* Stops what nobody waits for any more; false when the worker is to be buried. */
static bool cancel_unwanted(struct slot *slot)
{
    for (int i = 0; i < IN_FLIGHT; i++) {
        struct flight *flight = &slot->flights[i];
        if (!flight->render || flight->cancelled || flight->phase == PHASE_ENCODING ||
            scheduler_is_wanted(slot->pool->config.scheduler, flight->render))
            continue;
        flight->cancelled = true;
        count(slot->pool, &slot->pool->numbers.cancelled);
        struct channel_message message = {CHANNEL_VERSION, CHANNEL_CANCEL, flight->render->id};
        if (!channel_send(slot->socket, &message, NULL))
            return false;
    }
    return true;
}

/* Asks for pictures so far where somebody wants one; false when the worker is to be buried. */
static bool ask_for_parts(struct slot *slot)
{
    for (int i = 0; i < IN_FLIGHT; i++) {
        struct flight *flight = &slot->flights[i];
        if (!flight->render || flight->part_wanted || flight->phase == PHASE_ENCODING ||
            !scheduler_wants_part(slot->pool->config.scheduler, flight->render))
            continue;
        flight->part_wanted = true;
        struct channel_message message = {CHANNEL_VERSION, CHANNEL_WANT, flight->render->id};
        if (!channel_send(slot->socket, &message, NULL))
            return false;
    }
    return true;
}

static bool is_at_work(const struct slot *slot)
{
    for (int i = 0; i < IN_FLIGHT; i++)
        if (slot->flights[i].render)
            return true;
    return false;
}

/* How long a piece of work may take: many times what any took lately. As long as nothing is known, and
 * at most, what the settings say. */
static uint64_t patience_ns(const struct slot *slot)
{
    uint64_t most = slot->pool->config.hang_timeout_ms * CLOCK_MS;
    uint64_t expected = slot->silence_ns ? SILENCES * slot->silence_ns : most;
    expected = expected > LEAST_PATIENCE_NS ? expected : LEAST_PATIENCE_NS;
    return expected < most ? expected : most;
}

/* A worker hangs when it has work and gives no sign of life for longer than any piece of it takes. */
static bool is_hung(const struct slot *slot, uint64_t now)
{
    /* Of loading and encoding nothing is known. */
    uint64_t patience =
        slot->turning ? patience_ns(slot) : slot->pool->config.hang_timeout_ms * CLOCK_MS;
    /* A start and a warm-up take their time, whatever is asked of renders. */
    uint64_t start = patience > START_PATIENCE_NS ? patience : START_PATIENCE_NS;
    if (!slot->said_hello)
        return now - slot->spawned_ns > start;
    uint64_t since = slot->heard_ns;
    bool sent_only = true;
    for (int i = 0; i < IN_FLIGHT; i++) {
        const struct flight *flight = &slot->flights[i];
        if (!flight->render)
            continue;
        sent_only &= flight->phase == PHASE_SENT;
        since = flight->since_ns > since ? flight->since_ns : since;
    }
    return is_at_work(slot) && now - since > (sent_only ? start : patience);
}

/* Whether the process stands still: its heartbeat does not wait for anything. What this thread itself
 * has slept through is not held against it. */
static bool is_silent(struct slot *slot, uint64_t now)
{
    if (now - slot->looked_ns > OWN_SLEEP_NS)
        slot->alive_ns = now;
    slot->looked_ns = now;
    bool silent = slot->said_hello && now - slot->alive_ns > SILENT_NS;
    if (silent != slot->silent) {
        log_event(LOG_ERROR, "worker %u %s", slot->index, silent ? "stands still" : "goes on");
        pthread_mutex_lock(&slot->pool->lock);
        slot->silent = silent;
        slot->pool->numbers.silent += silent ? 1 : -1u;
        pthread_mutex_unlock(&slot->pool->lock);
    }
    return silent && now - slot->alive_ns > slot->pool->config.silence_timeout_ms * CLOCK_MS;
}

static int timeout_ms(uint64_t next_ns)
{
    uint64_t now = clock_now_ns();
    if (next_ns <= now)
        return 0;
    uint64_t ms = (next_ns - now) / CLOCK_MS + 1;
    return ms > 500 ? 500 : (int)ms;
}

static void *run(void *argument)
{
    struct slot *slot = argument;
    struct worker_pool *pool = slot->pool;
    uint64_t ignored;
    while (!is_stopping(pool)) {
        uint64_t next = scheduler_expire(pool->config.scheduler);
        uint64_t now = clock_now_ns();
        if (!slot->process.pid) {
            uint64_t backoff_ms =
                slot->failures ? 50ull << (slot->failures > 7 ? 7 : slot->failures) : 0;
            backoff_ms = backoff_ms > MAX_BACKOFF_MS ? MAX_BACKOFF_MS : backoff_ms;
            if (!slot->failures || now - slot->spawned_ns >= backoff_ms * CLOCK_MS)
                spawn(slot);
        }
        bool alive = slot->process.pid != 0;
        struct pollfd watch[] = {{slot->wake, POLLIN, 0}, {alive ? slot->socket : -1, POLLIN, 0},
            {alive ? slot->process.pidfd : -1, POLLIN, 0}};
        int wait_ms = alive ? timeout_ms(next) : 20;
        if (alive && is_at_work(slot) && wait_ms > WANTED_EVERY_MS)
            wait_ms = WANTED_EVERY_MS;
        poll(watch, 3, wait_ms);
        if (watch[0].revents && read(slot->wake, &ignored, sizeof ignored) < 0 && errno != EAGAIN)
            abort();
        if (slot->index == 0)
            look_after_cache(slot);
        if (!alive)
            continue;
        /* What a stopped process said before that is read first. */
        bool ok = worker_slot_hear(slot);
        if (is_silent(slot, clock_now_ns()) || is_hung(slot, clock_now_ns())) {
            slot->hung = true;
            process_signal(&slot->process, SIGKILL);
            process_wait(&slot->process, -1, &(int){0});
        }
        /* What a dead worker said last still counts: the socket is emptied before the funeral. */
        ok = ok && worker_slot_hear(slot);
        if (slot->hung || !ok || (watch[2].revents && !worker_slot_hear(slot)) ||
            (slot->said_hello && (!cancel_unwanted(slot) || !feed(slot) || !ask_for_parts(slot))))
            bury(slot);
    }
    if (slot->process.pid) {
        int status;
        shutdown(slot->socket, SHUT_RDWR);
        if (!process_wait(&slot->process, QUIT_MS, &status)) {
            process_signal(&slot->process, SIGKILL);
            process_wait(&slot->process, -1, &status);
        }
        bury(slot);
    }
    if (slot->index == 0) {
        process_signal(&pool->filler, SIGKILL);
        process_wait(&pool->filler, -1, &(int){0});
    }
    return NULL;
}

struct worker_pool *worker_pool_create(const struct worker_pool_config *config)
{
    struct worker_pool *pool = pen_alloc_zero(1, sizeof *pool);
    pool->config = *config;
    pthread_mutex_init(&pool->lock, NULL);
    pool->quarantine = quarantine_create(config->quarantine_s);
    pool->homes = homes_create();
    for (uint32_t i = 0; i < config->workers; i++) {
        struct slot *slot = &pool->slots[i];
        slot->pool = pool;
        slot->index = i;
        slot->socket = -1;
        slot->wake = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
        if (slot->wake < 0)
            abort();
    }
    for (uint32_t i = 0; i < config->workers; i++)
        if (pthread_create(&pool->slots[i].thread, NULL, run, &pool->slots[i]))
            abort();
    return pool;
}

void worker_pool_wake(struct worker_pool *pool)
{
    uint64_t one = 1;
    for (uint32_t i = 0; i < pool->config.workers; i++)
        if (write(pool->slots[i].wake, &one, sizeof one) < 0 && errno != EAGAIN)
            abort();
}

void worker_pool_destroy(struct worker_pool *pool)
{
    if (!pool)
        return;
    __atomic_store_n(&pool->stopping, true, __ATOMIC_RELEASE);
    worker_pool_wake(pool);
    for (uint32_t i = 0; i < pool->config.workers; i++) {
        pthread_join(pool->slots[i].thread, NULL);
        close(pool->slots[i].wake);
    }
    pthread_mutex_destroy(&pool->lock);
    quarantine_destroy(pool->quarantine);
    homes_destroy(pool->homes);
    free(pool);
}

void worker_pool_drop_scene(struct worker_pool *pool, const uint8_t scene[PEN_ID_BYTES])
{
    pthread_mutex_lock(&pool->lock);
    for (uint32_t i = 0; i < pool->config.workers; i++) {
        struct slot *slot = &pool->slots[i];
        if (slot->drop_count < MAX_DROPS) /* one that is forgotten here leaves by LRU */
            memcpy(slot->drops[slot->drop_count++], scene, PEN_ID_BYTES);
    }
    pthread_mutex_unlock(&pool->lock);
    worker_pool_wake(pool);
}

enum quarantined worker_pool_quarantined(
    struct worker_pool *pool, const struct pen_request *request, uint32_t *remaining_s)
{
    return quarantine_check(pool->quarantine, request, remaining_s);
}

bool worker_pool_is_resident(struct worker_pool *pool, const uint8_t scene[PEN_ID_BYTES])
{
    bool found = false;
    pthread_mutex_lock(&pool->lock);
    for (uint32_t i = 0; i < pool->config.workers; i++)
        for (uint32_t k = 0; k < pool->slots[i].resident.count; k++)
            found = found || !memcmp(pool->slots[i].resident.scenes[k], scene, PEN_ID_BYTES);
    pthread_mutex_unlock(&pool->lock);
    return found;
}

void worker_pool_read(struct worker_pool *pool, struct worker_pool_numbers *numbers)
{
    pthread_mutex_lock(&pool->lock);
    *numbers = pool->numbers;
    for (uint32_t i = 0; i < pool->config.workers; i++) {
        const struct pen_program_counts *p = &pool->slots[i].programs;
        numbers->programs.kept += p->kept;
        numbers->programs.bytes += p->bytes;
        numbers->programs.compiled += p->compiled;
        numbers->programs.evicted += p->evicted;
    }
    pthread_mutex_unlock(&pool->lock);
    numbers->quarantined = quarantine_count(pool->quarantine);
}
