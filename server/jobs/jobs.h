/* Work that nobody waits for with a connection open: renders, comparisons and sequences that go on
 * when the client has left and when the daemon was killed. Their frames are batches in the queue;
 * each is a file first and then a row of the database, so that what is recorded is there, and what is
 * there but not recorded is found at the next start. Thread-safe. */
#pragma once
#include "server/jobs/jobs_setup.h"

struct jobs;
/* Never fails: without a database (see jobs_store) it tries again every now and then. */
struct jobs *jobs_create(const struct jobs_config *config);
/* From now on nothing is begun; what is under way is given up at its next increment and begun again
 * at the next start. Event streams are told to end. */
void jobs_drain(struct jobs *jobs);
/* The scheduler's work must come to its end, or be cancelled, meanwhile. */
void jobs_destroy(struct jobs *jobs); /* NULL is fine */

/* NULL, and PEN_UNAVAILABLE that says why, where the database cannot be used. */
struct job_store *jobs_store(struct jobs *jobs, struct pen_error *error);

/* As of some seconds ago: it waits for nothing. False: the database cannot be used. */
bool jobs_read(struct jobs *jobs, struct job_numbers *numbers);

/* What a client asks for; `body` as job_plan_create takes it, needed for the call. */
struct job_order {
    enum job_kind kind;
    uint8_t scene[PEN_ID_BYTES];
    uint64_t client;
    const char *body;
    size_t bytes;
    struct job_key *key; /* NULL: none */
};
/* Accepts a job, and keeps it whatever happens from then on. Errors: of job_plan_create and
 * job_store_add, PEN_UNAVAILABLE while draining. */
bool jobs_submit(struct jobs *jobs, const struct job_order *order, uint8_t id[PEN_ID_BYTES],
    struct pen_error *error);
/* Ends a job that is under way: a frame that is being rendered ends at its next increment. One that
 * is over is removed with its files. *removed says which. Errors: of job_store_get. */
bool jobs_delete(
    struct jobs *jobs, const uint8_t id[PEN_ID_BYTES], bool *removed, struct pen_error *error);
/* A file of a job that job_files_read checks; -1 and its errors. */
int jobs_open_file(struct jobs *jobs, const uint8_t id[PEN_ID_BYTES], const struct job_file *file,
    bool checked, struct pen_error *error);
/* The request that gives a frame by itself. Errors: of job_store_get; PEN_NOT_FOUND, there is no such
 * frame; PEN_UNAVAILABLE while that is not known yet. */
bool jobs_frame_request(struct jobs *jobs, const struct job *job, uint32_t frame,
    struct pen_request *request, struct pen_error *error);
void jobs_watch(struct jobs *jobs, struct job_watch *watch);
/* `tell` is not called any more. One that does not watch is fine. */
void jobs_unwatch(struct jobs *jobs, struct job_watch *watch);
