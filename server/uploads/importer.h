/* Runs penumbra-import: a few processes at a time, each with a time limit, and files what they make
 * in the store. */
#pragma once
#include "server/uploads/upload.h"

struct import_task {
    struct import_task *next;
    struct upload *upload; /* the task's until `finish`; NULL: import a stale blob again */
    enum store_kind kind;
    uint8_t id[PEN_ID_BYTES]; /* filled in; PUT: see expects_id */
    bool expects_id;          /* the upload must hash to `id`, else PEN_INVALID */
    bool added;               /* false: it was there already */
    struct pen_error error;
    double ms;
    /* Called once, from an importer thread, with no lock held; the task is the owner's again. */
    void (*finish)(struct import_task *task);
};

struct importer_config {
    char import_path[4096];
    struct scene_store *store;
    uint32_t processes, queue_limit;
    uint64_t timeout_ms, memory_bytes, cpu_seconds;
};

struct importer;
struct importer *importer_create(const struct importer_config *config);
/* False, with the task untouched, when too many wait already or it is closing (PEN_UNAVAILABLE). */
bool importer_submit(struct importer *importer, struct import_task *task, struct pen_error *error);
/* Kills what runs; everything under way fails with PEN_UNAVAILABLE. */
void importer_cancel(struct importer *importer);
/* Cancels, and ends its threads: every task has been finished, and importer_submit refuses. */
void importer_stop(struct importer *importer);
void importer_destroy(struct importer *importer); /* NULL is fine */

struct importer_numbers {
    uint32_t waiting, running;
    uint64_t done, failed, crashed, timed_out;
};
void importer_read(struct importer *importer, struct importer_numbers *numbers);
