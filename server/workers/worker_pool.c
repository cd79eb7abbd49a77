#include "server/workers/worker_pool.h"
#include "protocol/memory.h"
#include "server/base/clock.h"
#include "server/base/log.h"
#include "server/workers/measured.h"
#include "server/base/process.h"
#include "server/workers/quarantine.h"
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

#define IN_FLIGHT 2    /* one renders while the other is encoded */
#define MAX_KILLS 2    /* of one render, by its own fault */
#define MAX_ATTEMPTS 6 /* of one render, when somebody else ends the workers */
#define QUIT_MS 3000
#define MAX_BACKOFF_MS 5000
#define START_PATIENCE_NS (120 * CLOCK_S)
#define MAX_DROPS 64

enum phase { PHASE_SENT, PHASE_RENDERING, PHASE_ENCODING };

struct flight {
    struct render *render; /* NULL: free */
    enum phase phase;
    uint64_t since_ns; /* of the phase */
};

struct slot {
    struct worker_pool *pool;
    pthread_t thread;
    int wake; /* eventfd */
    uint32_t index;
    uint8_t drops[MAX_DROPS][PEN_ID_BYTES]; /* guarded by pool->lock */
    uint32_t drop_count;                    /* guarded by pool->lock */
    struct channel_resident resident;       /* guarded by pool->lock */
    struct pen_program_counts programs;     /* guarded by pool->lock */
    /* Only the slot's thread: */
    struct process process;
    int socket;
    bool said_hello, is_replacement, hung;
    uint64_t spawned_ns, died_ns;
    uint32_t failures; /* in a row, before a hello */
    struct flight flights[IN_FLIGHT];
};

struct worker_pool {
    struct worker_pool_config config;
    struct quarantine *quarantine;
    pthread_mutex_t lock; /* guards numbers, and what says so in the slots */
    struct worker_pool_numbers numbers;
    bool stopping; /* atomic */
    struct slot slots[16];
};

static bool is_stopping(const struct worker_pool *pool)
{
    return __atomic_load_n(&pool->stopping, __ATOMIC_ACQUIRE);
}

static void spawn(struct slot *slot)
{
    struct worker_pool *pool = slot->pool;
    const struct pen_renderer_config *renderer = &pool->config.renderer;
    int pair[2];
    slot->spawned_ns = clock_now_ns();
    slot->said_hello = slot->hung = false;
    if (socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, pair)) {
        slot->failures++;
        return;
    }
    char device[24], index[24], gpu[4], debug[4], memory[24], warm[4];
    snprintf(device, sizeof device, "%u", renderer->device.choice);
    snprintf(index, sizeof index, "%u", renderer->device.index + slot->index);
    snprintf(gpu, sizeof gpu, "%d", renderer->device.require_gpu);
    snprintf(debug, sizeof debug, "%d", renderer->device.debug);
    snprintf(memory, sizeof memory, "%llu", (unsigned long long)renderer->gpu_memory_bytes);
    enum worker_warm_up warm_up = !pool->config.warm_up  ? WORKER_NO_WARM_UP
                                  : slot->is_replacement ? WORKER_WARM_UP_IDLE
                                                         : WORKER_WARM_UP_FIRST;
    snprintf(warm, sizeof warm, "%d", warm_up);
    char *arguments[] = {"penumbra-worker", "--device", device, "--device-index", index,
        "--require-gpu", gpu, "--gl-debug", debug, "--gpu-memory", memory, "--warm-up", warm, NULL};
    struct process_fd fd = {pair[1], CHANNEL_WORKER_FD};
    struct pen_error error = {0};
    if (process_start(&slot->process, pool->config.worker_path, arguments, &fd, 1, &error)) {
        slot->socket = pair[0];
    } else {
        log_event(LOG_ERROR, "worker %u could not be started: %s", slot->index, error.message);
        slot->failures++;
        close(pair[0]);
    }
    close(pair[1]);
}

static void finish(struct slot *slot, struct flight *flight, const struct outcome *outcome)
{
    struct render *render = flight->render;
    flight->render = NULL;
    scheduler_finish(slot->pool->config.scheduler, render, outcome);
}

static void count(struct worker_pool *pool, uint32_t *number)
{
    pthread_mutex_lock(&pool->lock);
    ++*number;
    pthread_mutex_unlock(&pool->lock);
}

/* The worker died under this render: gives it back to be tried again, or gives up on it. */
static void survive(struct slot *slot, struct flight *flight, bool guilty, bool own_fault)
{
    struct worker_pool *pool = slot->pool;
    struct render *render = flight->render;
    struct outcome outcome = {0};
    render->attempts += flight->phase != PHASE_SENT;
    render->kills += guilty && own_fault;
    bool give_up = render->kills >= MAX_KILLS || render->attempts >= MAX_ATTEMPTS;
    if (guilty && (own_fault || give_up) &&
        quarantine_blame(pool->quarantine, render->request.scene))
        log_event(LOG_ERROR, "a scene ended two workers and is refused from now on");
    if (is_stopping(pool)) {
        pen_fail(&outcome.error, PEN_UNAVAILABLE, "", "The service is shutting down.");
        finish(slot, flight, &outcome);
    } else if (give_up) {
        pen_fail(&outcome.error, PEN_INTERNAL, "", "Rendering this scene ends the renderer.");
        finish(slot, flight, &outcome);
    } else {
        count(pool, &pool->numbers.retries);
        flight->render = NULL;
        scheduler_return(pool->config.scheduler, render);
    }
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
    bool outside = WIFSIGNALED(status) && !slot->hung &&
                   (WTERMSIG(status) == SIGKILL || WTERMSIG(status) == SIGTERM);
    bool any_rendering = false;
    for (int i = 0; i < IN_FLIGHT; i++)
        any_rendering =
            any_rendering || (slot->flights[i].render && slot->flights[i].phase == PHASE_RENDERING);
    if (!is_stopping(pool)) {
        log_event(LOG_ERROR, "worker %u %s%s", slot->index, slot->hung ? "hung and " : "",
            process_describe(status, text, sizeof text));
        pthread_mutex_lock(&pool->lock);
        pool->numbers.restarts++;
        pool->numbers.hangs += slot->hung;
        pool->numbers.crashes += !slot->hung && !outside;
        pool->numbers.up -= slot->said_hello;
        pool->numbers.pids[slot->index] = 0;
        pthread_mutex_unlock(&pool->lock);
    }
    pthread_mutex_lock(&pool->lock);
    slot->resident.count = 0;
    pthread_mutex_unlock(&pool->lock);
    slot->failures = slot->said_hello ? 0 : slot->failures + 1;
    slot->is_replacement = true;
    for (int i = 0; i < IN_FLIGHT; i++) {
        struct flight *flight = &slot->flights[i];
        if (!flight->render)
            continue;
        enum phase suspect = any_rendering ? PHASE_RENDERING : PHASE_ENCODING;
        survive(slot, flight, flight->phase == suspect, !outside);
    }
}

static struct flight *find_flight(struct slot *slot, uint64_t job)
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
    numbers->device.renderer[sizeof numbers->device.renderer - 1] = 0;
    numbers->device.version[sizeof numbers->device.version - 1] = 0;
    numbers->device.platform[sizeof numbers->device.platform - 1] = 0;
    numbers->create_ms = hello->create_ms;
    numbers->up++;
    numbers->pids[slot->index] = (int)slot->process.pid;
    if (slot->died_ns)
        numbers->back_ms = back_ms;
    pthread_mutex_unlock(&pool->lock);
    log_event(LOG_INFO, "worker %u (pid %d) renders on %s (%s%s), context in %.0f ms%s%.0f%s",
        slot->index, (int)slot->process.pid, hello->device.renderer, hello->device.platform,
        hello->device.software ? ", software" : "", hello->create_ms,
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
    struct flight *flight = find_flight(slot, message->job);
    if (!flight)
        return;
    struct pen_result result = message->result;
    pen_error_receive(&result.error);
    struct outcome outcome = {.error = result.error};
    result.stage_ms[PEN_STAGE_QUEUE] =
        (float)clock_ms(flight->render->taken_ns - flight->render->queued_ns);
    pthread_mutex_lock(&pool->lock);
    pool->numbers.gpu_bytes = result.gpu_bytes;
    pthread_mutex_unlock(&pool->lock);
    take_programs(slot, &result.programs);
    outcome.result = &result;
    if (outcome.error.code == PEN_OK && flight->render->measure != MEASURE_PICTURE) {
        measured_take(flight->render->measure, fds, &outcome);
        pool->config.on_measured(pool->config.context, &result);
    } else if (outcome.error.code == PEN_OK) {
        char tag[PEN_ID_HEX + 1];
        picture_tag(&flight->render->request, &result.device, tag);
        outcome.picture =
            fds->count == 1 ? picture_create(fds->fd[0], &result, tag, &outcome.error) : NULL;
        if (!outcome.picture)
            pen_fail(&outcome.error, PEN_INTERNAL, "", "The worker handed over no image.");
        else
            pool->config.on_picture(pool->config.context, outcome.picture);
    }
    finish(slot, flight, &outcome);
    measured_release(&outcome);
}

/* False when the worker is to be buried. */
static bool on_message(
    struct slot *slot, const struct channel_message *message, const struct channel_fds *fds)
{
    struct flight *flight = find_flight(slot, message->job);
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
    case CHANNEL_STARTED:
    case CHANNEL_RENDERED:
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
    case CHANNEL_DONE:
        on_done(slot, message, fds);
        return true;
    default:
        return false;
    }
}

/* Reads everything that is there; false when the worker is to be buried. */
static bool drain_socket(struct slot *slot)
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

/* Sends one render; false when the worker is to be buried. */
static bool dispatch(struct slot *slot, struct flight *flight, struct render *render)
{
    struct worker_pool *pool = slot->pool;
    struct channel_message message = {CHANNEL_VERSION, CHANNEL_JOB, render->id};
    struct channel_fds fds = {0};
    struct outcome outcome = {0};
    flight->render = render;
    flight->phase = PHASE_SENT;
    flight->since_ns = clock_now_ns();
    message.job_data.request = render->request;
    message.job_data.measure = render->measure;
    if (!pool->config.open_job(pool->config.context, &message.job_data, &fds, &outcome.error)) {
        channel_close_fds(&fds);
        finish(slot, flight, &outcome);
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
            struct render *render = scheduler_take(pool->config.scheduler);
            if (!render)
                return true;
            if (!dispatch(slot, &slot->flights[i], render))
                return false;
        }
    }
    return true;
}

/* A worker hangs when something has been under way for too long and nobody can still want it. */
static bool is_hung(const struct slot *slot, uint64_t now)
{
    uint64_t patience = slot->pool->config.hang_timeout_ms * CLOCK_MS;
    /* A start and a warm-up take their time, whatever is asked of renders. */
    uint64_t start = patience > START_PATIENCE_NS ? patience : START_PATIENCE_NS;
    if (!slot->said_hello)
        return now - slot->spawned_ns > start;
    for (int i = 0; i < IN_FLIGHT; i++) {
        const struct flight *flight = &slot->flights[i];
        uint64_t limit = flight->phase == PHASE_SENT ? start : patience;
        if (flight->render && now - flight->since_ns > limit &&
            now > flight->render->last_deadline_ns)
            return true;
    }
    return false;
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
        poll(watch, 3, alive ? timeout_ms(next) : 20);
        if (watch[0].revents && read(slot->wake, &ignored, sizeof ignored) < 0 && errno != EAGAIN)
            abort();
        if (!alive)
            continue;
        if (is_hung(slot, clock_now_ns())) {
            slot->hung = true;
            process_signal(&slot->process, SIGKILL);
            process_wait(&slot->process, -1, &(int){0});
        }
        /* What a dead worker said last still counts: the socket is emptied before the funeral. */
        bool ok = drain_socket(slot);
        if (slot->hung || !ok || (watch[2].revents && !drain_socket(slot)) ||
            (slot->said_hello && !feed(slot)))
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
    return NULL;
}

struct worker_pool *worker_pool_create(const struct worker_pool_config *config)
{
    struct worker_pool *pool = pen_alloc_zero(1, sizeof *pool);
    pool->config = *config;
    pthread_mutex_init(&pool->lock, NULL);
    pool->quarantine = quarantine_create(config->quarantine_s);
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

uint32_t worker_pool_quarantine_s(struct worker_pool *pool, const uint8_t scene[PEN_ID_BYTES])
{
    return quarantine_remaining_s(pool->quarantine, scene);
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
