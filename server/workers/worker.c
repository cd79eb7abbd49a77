/* penumbra-worker: one GL context on the main thread, and encoder threads, so that frame N + 1
 * renders while frame N is encoded. Talks to penumbrad on CHANNEL_WORKER_FD and ends with it. */
#include "protocol/memory.h"
#include "renderer/renderer.h"
#include "server/workers/channel.h"
#include "server/base/clock.h"
#include "server/workers/worker_encoder.h"
#include "server/workers/worker_measure.h"
#include "server/workers/worker_turns.h"
#include <errno.h>
#include <fcntl.h>
#include <malloc.h>
#include <poll.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <unistd.h>

#define TELL_TURN_MS 250

struct worker {
    struct pen_renderer *renderer;
    struct worker_turns *turns;
    uint64_t told_job, told_ns; /* whose turn it is, as told last */
    struct worker_encoder *encoder;
    struct channel_resident resident; /* as told last, most recently used first */
};

static void send_or_exit(const struct channel_message *message)
{
    if (!channel_send(CHANNEL_WORKER_FD, message, NULL))
        _exit(WORKER_EXIT_PROTOCOL); /* the daemon is gone */
}

/* A process that is stopped, frozen or starved is silent; a pass that takes long is not. */
static void *say_alive(void *argument)
{
    (void)argument;
    static const struct channel_message message = {CHANNEL_VERSION, CHANNEL_ALIVE, 0};
    while (channel_send(CHANNEL_WORKER_FD, &message, NULL))
        usleep(CHANNEL_ALIVE_MS * 1000);
    return NULL;
}

static void begin_to_say_alive(void)
{
    pthread_t thread;
    if (pthread_create(&thread, NULL, say_alive, NULL))
        abort();
    pthread_detach(thread);
}

static void warm_up(struct worker *worker)
{
    static struct channel_message message;
    message.version = CHANNEL_VERSION;
    message.kind = CHANNEL_WARM;
    message.warm.warm_ms = (float)pen_renderer_warm_up(worker->renderer, PEN_WARM_USUAL);
    message.warm.gpu_bytes = pen_renderer_gpu_bytes(worker->renderer);
    message.warm.programs = pen_renderer_programs(worker->renderer);
    send_or_exit(&message);
}

/* Tells the daemon which scenes are in GPU memory when that has changed; `used` (or NULL) was used
 * just now. */
static void tell_resident(struct worker *worker, const uint8_t *used)
{
    static struct channel_message message;
    struct channel_resident *now = &message.resident;
    memset(now, 0, sizeof *now);
    if (used && pen_renderer_has_scene(worker->renderer, used))
        memcpy(now->scenes[now->count++], used, PEN_ID_BYTES);
    for (uint32_t i = 0; i < worker->resident.count && now->count < CHANNEL_MAX_RESIDENT; i++) {
        const uint8_t *scene = worker->resident.scenes[i];
        bool first = used && !memcmp(scene, used, PEN_ID_BYTES);
        if (!first && pen_renderer_has_scene(worker->renderer, scene))
            memcpy(now->scenes[now->count++], scene, PEN_ID_BYTES);
    }
    if (!memcmp(now, &worker->resident, sizeof *now))
        return;
    worker->resident = *now;
    message.version = CHANNEL_VERSION;
    message.kind = CHANNEL_RESIDENT;
    send_or_exit(&message);
}

static enum pen_admission admit(struct worker *worker, const struct channel_job *job,
    const struct pen_request *request, const struct channel_fds *fds, struct pen_error *error)
{
    struct pen_blobs blobs = {.count = 1 + job->image_count};
    for (uint32_t i = 0; i < blobs.count; i++) {
        blobs.ids[i] = i ? job->images[i - 1] : job->request.scene;
        blobs.fds[i] = fds->fd[i];
    }
    return pen_renderer_admit(worker->renderer, request, &blobs, error);
}

static struct worker_item *make_item(const struct channel_message *message)
{
    const struct channel_job *job = &message->job_data;
    struct worker_item *item = pen_alloc_zero(1, sizeof *item);
    item->message.version = CHANNEL_VERSION;
    item->message.kind = CHANNEL_DONE;
    item->message.job = message->job;
    item->message.result.completed = job->request;
    item->output = job->request.output;
    item->measure = job->measure;
    item->reference_fd = -1;
    item->fresh = job->fresh != 0;
    item->part_wanted = job->parts != 0;
    item->best_until_ns = job->best_until_ns;
    return item;
}

/* What the renderer does not know of an answer. */
static void complete(const struct worker *worker, struct worker_item *item)
{
    struct pen_result *result = &item->message.result;
    result->completed.output = item->output;
    result->stage_ms[PEN_STAGE_LOAD] = item->load_ms; /* the render started afresh */
    result->scene_was_resident = item->was_resident;
    result->device = *pen_renderer_device(worker->renderer);
    result->gpu_bytes = pen_renderer_gpu_bytes(worker->renderer);
    result->programs = pen_renderer_programs(worker->renderer);
}

static void on_part(void *context, struct worker_item *part)
{
    struct worker *worker = context;
    complete(worker, part);
    worker_encoder_submit(worker->encoder, part);
}

/* Hands a render that has ended to the encoders; failures too: they answer. False when the context
 * is lost: the job stays unanswered and the daemon gives it to another. */
static bool hand_over(struct worker *worker, struct worker_item *item)
{
    struct pen_renderer *renderer = worker->renderer;
    struct pen_result *result = &item->message.result;
    if (result->error.code != PEN_OK && pen_renderer_loss(renderer)) {
        free(item);
        return false;
    }
    complete(worker, item);
    tell_resident(worker, result->completed.scene); /* before the answer, so that both agree */
    send_or_exit(&(struct channel_message){CHANNEL_VERSION, CHANNEL_RENDERED, item->message.job});
    worker_encoder_submit(worker->encoder, item);
    return true;
}

/* Begins a job, or gives it back when there is no room for it now. As hand_over. */
static bool take_job(
    struct worker *worker, const struct channel_message *message, const struct channel_fds *fds)
{
    const struct channel_job *job = &message->job_data;
    send_or_exit(&(struct channel_message){CHANNEL_VERSION, CHANNEL_STARTED, message->job});
    worker->told_job = 0; /* whose turn it then is has to be told */
    struct worker_item *item = make_item(message);
    struct pen_error *error = &item->message.result.error;
    bool compares = measure_has_reference(job->measure);
    bool ok = job->image_count <= PEN_MAX_LIGHTS && job->measure <= MEASURE_NUMBERS &&
              fds->count == 1 + job->image_count + compares;
    if (!ok)
        pen_fail(error, PEN_INTERNAL, "", "The worker was handed an incomplete job.");
    ok = ok && pen_request_check(&job->request, pen_renderer_catalogue(), error);
    item->was_resident = ok && pen_renderer_has_scene(worker->renderer, job->request.scene);
    uint64_t start = clock_now_ns();
    struct pen_request request = job->request;
    if (job->measure != MEASURE_PICTURE)
        worker_measure_output(&request.output);
    enum pen_admission admission = ok ? admit(worker, job, &request, fds, error) : PEN_REFUSED;
    if (admission == PEN_LATER) {
        free(item);
        tell_resident(worker, NULL);
        send_or_exit(&(struct channel_message){CHANNEL_VERSION, CHANNEL_BUSY, message->job});
        return true;
    }
    ok = admission == PEN_ADMITTED;
    item->load_ms = (float)clock_ms(clock_now_ns() - start);
    if (ok && job->measure != MEASURE_PICTURE)
        pen_renderer_drop_shadows(worker->renderer);
    if (ok && compares)
        item->reference_fd = fcntl(fds->fd[1 + job->image_count], F_DUPFD_CLOEXEC, 3);
    return (ok && worker_turns_begin(worker->turns, &request, job->client, item)) ||
           hand_over(worker, item);
}

/* A job that is being encoded is not stopped any more. */
static bool cancel_job(struct worker *worker, uint64_t job)
{
    struct worker_item *item = worker_turns_cancel(worker->turns, job);
    return !item || hand_over(worker, item);
}

/* Tells the daemon whose turn it is: when that changes, and now and then as a sign of life. */
static void tell_turn(struct worker *worker, uint64_t job)
{
    uint64_t now = clock_now_ns();
    if (job == worker->told_job && now - worker->told_ns < TELL_TURN_MS * CLOCK_MS)
        return;
    worker->told_job = job;
    worker->told_ns = now;
    static struct channel_message message = {CHANNEL_VERSION, CHANNEL_TURN};
    message.job = job;
    message.turn.place = worker_turns_place(worker->turns);
    send_or_exit(&message);
}

/* One turn of whoever is next. */
static bool run_turn(struct worker *worker)
{
    uint64_t job = worker_turns_next(worker->turns);
    if (!job)
        return true;
    tell_turn(worker, job);
    struct worker_item *item = worker_turns_run(worker->turns);
    if (!item) /* of what it has drawn since nothing could be relied upon */
        return pen_renderer_loss(worker->renderer) == PEN_LOSS_NONE;
    return hand_over(worker, item);
}

static void drop(struct worker *worker, const uint8_t scene[PEN_ID_BYTES])
{
    pen_renderer_drop_scene(worker->renderer, scene);
    tell_resident(worker, NULL);
}

static bool take_message(
    struct worker *worker, const struct channel_message *message, struct channel_fds *fds)
{
    switch (message->kind) {
    case CHANNEL_JOB:
        return take_job(worker, message, fds);
    case CHANNEL_CANCEL:
        return cancel_job(worker, message->job);
    case CHANNEL_WANT:
        worker_turns_want(worker->turns, message->job);
        return true;
    case CHANNEL_DROP:
        drop(worker, message->drop.scene);
        return true;
    default:
        return true;
    }
}

/* Something has come from the daemon: what is in progress is not to keep it waiting. */
static bool is_called(void *context)
{
    (void)context;
    struct pollfd watch = {CHANNEL_WORKER_FD, POLLIN, 0};
    return poll(&watch, 1, 0) > 0;
}

static int exit_status(struct pen_renderer *renderer)
{
    switch (pen_renderer_loss(renderer)) {
    case PEN_LOSS_NONE:
        return 0;
    case PEN_LOSS_MEMORY:
        return WORKER_EXIT_MEMORY;
    case PEN_LOSS_OTHERS:
        return WORKER_EXIT_OTHERS;
    case PEN_LOSS_OWN:
        break;
    }
    return WORKER_EXIT_LOST;
}

/* Returns the exit status once the daemon hangs up or nothing can be drawn any more. */
static int serve(struct worker *worker)
{
    static struct channel_message message;
    struct channel_fds fds;
    for (;;) {
        bool busy = worker_turns_next(worker->turns) != 0;
        struct pollfd watch = {CHANNEL_WORKER_FD, POLLIN, 0};
        int n = poll(&watch, 1, busy ? 0 : -1);
        if (n < 0 && errno == EINTR)
            continue;
        bool alive = true;
        if (n != 0) {
            int got = channel_receive(CHANNEL_WORKER_FD, &message, &fds);
            if (got == 0 || (got < 0 && errno == ECONNRESET))
                return 0;
            if (got < 0)
                return WORKER_EXIT_PROTOCOL;
            alive = take_message(worker, &message, &fds);
            channel_close_fds(&fds);
        } else {
            alive = run_turn(worker);
        }
        if (!alive)
            return exit_status(worker->renderer);
    }
}

static int fill_cache(const struct pen_renderer_config *config, bool gives_way)
{
    if (gives_way) /* whoever renders goes first */
        setpriority(PRIO_PROCESS, 0, 19);
    struct pen_renderer *renderer = pen_renderer_create(config, NULL);
    if (!renderer)
        return WORKER_EXIT_REFUSED;
    pen_renderer_warm_up(renderer, PEN_WARM_ALL);
    int status = exit_status(renderer);
    pen_renderer_destroy(renderer);
    return status;
}

/* A software driver allocates a frame's vertices and bins anew for each, some megabytes. What is given
 * back to the system in between costs a page fault per 4 KiB: 1,400 of them a frame, on the one thread
 * that draws. So much is kept instead. */
static void keep_freed_pages(void)
{
    mallopt(M_MMAP_THRESHOLD, 8 << 20);
    mallopt(M_TRIM_THRESHOLD, 16 << 20);
}

int main(int argc, char **argv)
{
    keep_freed_pages();
    struct pen_renderer_config config = {.is_called = is_called};
    static struct worker worker;
    enum worker_warm_up what = WORKER_NO_WARM_UP;
    for (int i = 1; i + 1 < argc; i += 2) {
        unsigned long long value = strtoull(argv[i + 1], NULL, 10);
        if (!strcmp(argv[i], "--device"))
            config.device.choice = (uint32_t)value;
        else if (!strcmp(argv[i], "--device-index"))
            config.device.index = (uint32_t)value;
        else if (!strcmp(argv[i], "--require-gpu"))
            config.device.require_gpu = value != 0;
        else if (!strcmp(argv[i], "--gl-debug"))
            config.device.debug = value != 0;
        else if (!strcmp(argv[i], "--gpu-memory"))
            config.gpu_memory_bytes = value;
        else if (!strcmp(argv[i], "--warm-up"))
            what = (enum worker_warm_up)value;
    }
    if (what == WORKER_WARM_UP_FILL || what == WORKER_WARM_UP_FILL_NOW)
        return fill_cache(&config, what == WORKER_WARM_UP_FILL);
    pen_memory_exit(WORKER_EXIT_MEMORY);
    static struct channel_message hello;
    struct pen_error error = {0};
    uint64_t start = clock_now_ns();
    worker.renderer = pen_renderer_create(&config, &error);
    hello.version = CHANNEL_VERSION;
    if (!worker.renderer) {
        hello.kind = CHANNEL_REFUSED;
        hello.refused = error;
        send_or_exit(&hello);
        return WORKER_EXIT_REFUSED;
    }
    worker.turns = worker_turns_create(worker.renderer, on_part, &worker);
    worker.encoder = worker_encoder_create(CHANNEL_WORKER_FD);
    hello.kind = CHANNEL_HELLO;
    hello.hello.pid = (uint32_t)getpid();
    hello.hello.create_ms = (float)clock_ms(clock_now_ns() - start);
    hello.hello.device = *pen_renderer_device(worker.renderer);
    send_or_exit(&hello);
    begin_to_say_alive();
    if (what == WORKER_WARM_UP_USUAL)
        warm_up(&worker);
    int status = serve(&worker);
    worker_encoder_destroy(worker.encoder);
    if (pen_renderer_loss(worker.renderer))
        _exit(status); /* nothing of a lost context is worth tidying */
    worker_turns_destroy(worker.turns);
    pen_renderer_destroy(worker.renderer);
    return status;
}
