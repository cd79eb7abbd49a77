/* What the workers are started with, and what is known of them. */
#pragma once
#include "renderer/renderer.h"
#include "server/queue/scheduler.h"
#include "server/workers/channel.h"

struct worker_pool_config {
    char worker_path[4096];
    struct pen_renderer_config renderer;
    const struct pen_catalogue *catalogue;
    bool warm_up;
    uint32_t workers;
    uint64_t hang_timeout_ms, silence_timeout_ms, quarantine_s;
    struct scheduler *scheduler;
    /* Opens the blobs that a request needs: fds->fd[0] the scene's, then one per entry of
     * job->images. Called from the pool's threads. */
    bool (*open_job)(
        void *context, struct channel_job *job, struct channel_fds *fds, struct pen_error *error);
    /* A picture was made (before those who wait are answered). */
    void (*on_picture)(void *context, struct picture *picture);
    /* One that was rendered to be measured; the result has its times. */
    void (*on_measured)(void *context, const struct pen_result *result);
    void *context;
};

struct worker_pool_numbers {
    bool has_device; /* a worker has said on what it renders */
    struct pen_device_info device;
    bool warmed;     /* a worker has been through its warm-up */
    uint32_t up;     /* workers that take jobs now */
    uint32_t silent; /* of these, whose processes stand still */
    uint32_t restarts, crashes, hangs, starved, retries, quarantined, cancelled;
    uint64_t gpu_bytes;
    struct pen_program_counts programs; /* of all workers, each since its start */
    double create_ms, warm_ms;          /* of the last worker that started */
    double cache_ms;                    /* what filling the shader cache took; 0: not filled yet */
    double back_ms;                     /* from the death of a worker to its successor's hello */
    int pids[16];
    struct pen_error refused; /* the first worker found no device; it is not tried again */
};
