/* What is known of jobs, in the database: jobs, the frames that they have, and the keys under which
 * clients asked for them. Thread-safe. Times are seconds since 1970. Errors of every function: those
 * of database.h, and as noted. */
#pragma once
#include "protocol/error.h"
#include "protocol/limits.h"
#include <stddef.h>
#include <stdint.h>

enum job_kind { JOB_RENDER, JOB_COMPARE, JOB_SEQUENCE, JOB_KINDS };
enum job_state {
    JOB_ACCEPTED,
    JOB_RUNNING, /* at least one frame was begun */
    JOB_SUCCESSFUL,
    JOB_FAILED,
    JOB_DISMISSED, /* cancelled */
    JOB_STATES
};
extern const char *const job_kind_names[], *const job_state_names[]; /* ended by NULL */
static inline bool job_is_over(enum job_state state)
{
    return state > JOB_RUNNING;
}

#define JOB_NAME_BYTES 32

/* One file of a job. */
struct job_file {
    uint64_t bytes;
    char tag[PEN_ID_HEX + 1]; /* SHA-256 of its bytes; "": there is none */
    char name[JOB_NAME_BYTES];
};

struct job {
    uint8_t id[PEN_ID_BYTES]; /* begins with the time: newer jobs have higher ones */
    uint8_t scene[PEN_ID_BYTES];
    uint64_t client;
    enum job_kind kind;
    enum job_state state;
    uint32_t frames, done;   /* asked for, and there */
    uint64_t bytes;          /* of all its files */
    uint32_t seq, state_seq; /* number of its last event, and of the last that changed its state */
    int64_t created_s, ended_s, expires_s; /* 0: not yet */
    char settings[96];                     /* what was found with the first frame; "": nothing */
    struct job_file result;                /* besides the frames */
    struct pen_error error;                /* why it failed */
};

struct job_frame {
    uint32_t number, seq; /* seq: of the event that told of it */
    struct job_file file;
};

/* How many there may be. */
struct job_limits {
    uint32_t active, active_per_client; /* that are not over */
    uint32_t kept, kept_per_client;     /* over or not */
    uint64_t bytes;                     /* of all files */
};

/* "Idempotency-Key": what a client's key stands for. */
struct job_key {
    uint64_t client;
    const char *text;
    uint8_t print[PEN_ID_BYTES]; /* of the request that it came with */
    int64_t expires_s;
};

struct job_store;
struct job_store *job_store_open(const char *path, struct pen_error *error);
void job_store_close(struct job_store *store); /* NULL is fine */

/* A new job with its body, and the key that it was asked for with (NULL: none). Where the key stands
 * for a job already, since another request with it came in between, that one's id takes the place of
 * job->id and nothing is added. Errors also: PEN_INVALID, as of job_store_find_key, PEN_TOO_MANY for what is the client's share, PEN_UNAVAILABLE for what is everybody's, with
 * retry_after_s where that is known: when the next one expires. */
bool job_store_add(struct job_store *store, struct job *job, const char *body,
    const struct job_key *key, const struct job_limits *limits, struct pen_error *error);
/* Errors also: PEN_NOT_FOUND. */
bool job_store_get(struct job_store *store, const uint8_t id[PEN_ID_BYTES], struct job *job,
    struct pen_error *error);
/* malloc'd; NULL: no such job, or no database. */
char *job_store_body(struct job_store *store, const uint8_t id[PEN_ID_BYTES]);

/* Jobs from the newest on, of a client (0: of all), in a state (JOB_STATES: in any), older than
 * `before` (NULL: from the newest). Sets *count, at most `most`, and *total, without `before`. */
struct job_page {
    uint64_t client;
    enum job_state state;
    const uint8_t *before;
    struct job *jobs;
    uint32_t most, count, total;
};
bool job_store_list(struct job_store *store, struct job_page *page, struct pen_error *error);
/* Ids of those that are not over, from the oldest on; malloc'd. */
bool job_store_active(struct job_store *store, uint8_t (**ids)[PEN_ID_BYTES], uint32_t *count,
    struct pen_error *error);
bool job_store_exists(
    struct job_store *store, const uint8_t id[PEN_ID_BYTES], bool *exists, struct pen_error *error);

/* Frames whose events came after `seq`, in that order, at most `most`; *before: how many came before
 * (may be NULL). */
bool job_store_frames(struct job_store *store, const uint8_t id[PEN_ID_BYTES], uint32_t seq,
    struct job_frame *frames, uint32_t most, uint32_t *count, uint32_t *before,
    struct pen_error *error);
/* Errors also: PEN_NOT_FOUND. */
bool job_store_frame(struct job_store *store, const uint8_t id[PEN_ID_BYTES], uint32_t number,
    struct job_frame *frame, struct pen_error *error);

/* A frame is there; one that was recorded before stays as it was. */
bool job_store_add_frame(struct job_store *store, const uint8_t id[PEN_ID_BYTES],
    const struct job_frame *frame, struct pen_error *error);
bool job_store_set_settings(struct job_store *store, const uint8_t id[PEN_ID_BYTES],
    const char *settings, struct pen_error *error);
/* A job goes on to `state`; of one that ends also its times, its result and its error are set. False
 * without an error: it is over already. */
bool job_store_set_state(struct job_store *store, const struct job *job, struct pen_error *error);

/* The next job that has expired, and its keys, are forgotten; false: none, or no database. */
bool job_store_expire(struct job_store *store, int64_t now_s, uint8_t id[PEN_ID_BYTES]);
bool job_store_remove(
    struct job_store *store, const uint8_t id[PEN_ID_BYTES], struct pen_error *error);

/* What a key stands for. *found: it is known; *has_job: for a job that is still there. Errors also:
 * PEN_INVALID, it came with another request before. */
bool job_store_find_key(struct job_store *store, const struct job_key *key, int64_t now_s,
    bool *found, bool *has_job, uint8_t id[PEN_ID_BYTES], struct pen_error *error);
/* A key of a request that is answered at once; the client's oldest ones go when it has too many. */
bool job_store_keep_key(
    struct job_store *store, const struct job_key *key, struct pen_error *error);

struct job_numbers {
    uint32_t jobs[JOB_STATES];
    uint64_t bytes;
};
bool job_store_read(struct job_store *store, struct job_numbers *numbers, struct pen_error *error);
