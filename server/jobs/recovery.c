#include "server/jobs/recovery.h"
#include "protocol/memory.h"
#include "server/base/log.h"
#include "server/jobs/store/job_files.h"
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define PIECE 256

static void mark_done(struct running *r, uint32_t frame)
{
    if (frame >= r->job.frames || r->frames[frame] == FRAME_DONE)
        return;
    r->frames[frame] = FRAME_DONE;
    r->there++;
}

static bool read_recorded(struct job_store *store, struct running *r, struct pen_error *error)
{
    struct job_frame *frames = pen_alloc(PIECE, sizeof *frames);
    uint32_t seq = 0, count = 0;
    bool ok;
    do {
        ok = job_store_frames(store, r->job.id, seq, frames, PIECE, &count, NULL, error);
        for (uint32_t i = 0; ok && i < count; i++) {
            mark_done(r, frames[i].number);
            seq = frames[i].seq;
        }
    } while (ok && count == PIECE);
    free(frames);
    return ok;
}

/* Files that got their name just before the daemon ended, and are not recorded: whole, since a file
 * has its name only then. */
static bool adopt_files(
    struct jobs *j, struct job_store *store, struct running *r, struct pen_error *error)
{
    int folder = job_files_open(j->root, r->job.id, error);
    bool ok = folder >= 0;
    for (uint32_t i = 0; ok && r->is_settled && i < r->job.frames; i++) {
        struct job_frame frame = {.number = i};
        if (r->frames[i] == FRAME_DONE)
            continue;
        job_plan_name(r->plan, i, frame.file.name);
        if (!job_files_find(folder, &frame.file))
            continue;
        ok = job_store_add_frame(store, r->job.id, &frame, error);
        if (ok)
            mark_done(r, i);
    }
    if (folder >= 0)
        close(folder);
    return ok;
}

/* NULL: it cannot go on, which is recorded. */
static struct running *recover(
    struct jobs *j, struct job_store *store, const uint8_t id[PEN_ID_BYTES])
{
    struct job job;
    struct pen_error error = {0};
    struct running *r = NULL;
    if (!job_store_get(store, id, &job, &error))
        return NULL;
    char *body = job_store_body(store, id);
    struct job_plan *plan = job_plan_create(
        &j->config.makers, job.kind, job.scene, body ? body : "", body ? strlen(body) : 0, &error);
    free(body);
    if (plan && job_plan_frames(plan) != job.frames)
        pen_fail(&error, PEN_INTERNAL, "", "This build makes another sequence of the request.");
    if (plan && error.code == PEN_OK) {
        r = jobs_make_running(j, &job, plan);
        plan = NULL;
        if (read_recorded(store, r, &error) &&
            (job.kind == JOB_COMPARE || adopt_files(j, store, r, &error)))
            return r;
    }
    job_plan_destroy(plan);
    jobs_free_running(r);
    if (error.code == PEN_UNAVAILABLE || error.code == PEN_FULL) /* goes on at a later start */
        return NULL;
    job.state = JOB_FAILED;
    job.error = error;
    job.ended_s = jobs_now_s();
    job.expires_s = jobs_expiry_s(j);
    job_store_set_state(store, &job, NULL);
    return NULL;
}

static bool is_known(void *context, const uint8_t id[PEN_ID_BYTES])
{
    struct job_store *store = context;
    bool exists = true;
    return !job_store_exists(store, id, &exists, NULL) || exists;
}

void jobs_recover(struct jobs *j, struct job_store *store)
{
    uint8_t(*ids)[PEN_ID_BYTES] = NULL;
    uint32_t count = 0, taken = 0;
    struct running **last = &j->first;
    struct job_numbers numbers;
    if (job_store_active(store, &ids, &count, NULL))
        for (uint32_t i = 0; i < count; i++) {
            struct running *r = recover(j, store, ids[i]);
            if (!r)
                continue;
            pthread_mutex_lock(&j->lock);
            *last = r;
            last = &r->next;
            pthread_mutex_unlock(&j->lock);
            taken++;
        }
    free(ids);
    if (taken)
        log_event(LOG_INFO, "%u jobs go on", taken);
    job_files_sweep(j->root, is_known, store);
    j->bytes = job_store_read(store, &numbers, NULL) ? numbers.bytes : 0;
}
