/* What the files of this folder share about jobs under way. */
#pragma once
#include "server/jobs/jobs_setup.h"
#include "server/queue/compare.h"
#include <pthread.h>

#define JOBS_OPEN_S 10 /* until a database that cannot be used is tried again */

enum frame_state { FRAME_TODO, FRAME_IN_FLIGHT, FRAME_DONE };

/* A job that is not over. */
struct running {
    struct running *next;
    struct jobs *jobs;
    struct job_plan *plan; /* constant */
    bool cancelled;        /* atomic */
    /* The runner's, or the finisher's while it has it: */
    struct job job;
    uint8_t *frames;           /* enum frame_state */
    uint8_t *attempts;         /* of each frame, that failed */
    uint32_t first;            /* no frame before it is to be done */
    uint32_t in_flight, there; /* there: atomic, for those who ask when it will be over */
    uint64_t begun_ns;
    uint64_t served;       /* number of the frame that was begun last */
    uint64_t due_ns;       /* nothing is begun before */
    bool is_settled;       /* job.settings holds, or is not needed */
    bool has_failed;       /* atomic; job.error says why */
    bool is_finished;      /* the finisher is done with it */
    bool is_with_finisher; /* atomic */
};

/* A frame that was given to the queue, or a comparison. */
struct flight {
    struct flight *next;
    struct waiter waiter;
    struct running *job;
    uint32_t frame, writes;
    bool is_part; /* an image of a comparison that goes on: does not count as in flight */
    uint64_t due_ns;
    struct picture *picture;
    struct compare *compare;
    struct pen_error error;
};

struct jobs {
    struct jobs_config config;
    pthread_mutex_t lock; /* guards what follows */
    pthread_cond_t news;  /* for the runner */
    struct job_store *store;
    struct pen_error why_none; /* no store */
    struct running *incoming;  /* not seen by the runner yet */
    struct running *first;     /* from the oldest on */
    struct flight *ended;
    struct running *to_finish;
    pthread_cond_t to_finish_news;
    struct job_numbers numbers;
    bool draining, woken;
    double frame_ms; /* from one frame to the next, decaying; 0: not known */
    uint64_t last_frame_ns;
    int root;                   /* the folder of all files; -1: none */
    pthread_mutex_t watch_lock; /* guards the list, and is held while they are told */
    struct job_watch *watches;
    pthread_t runner, finisher;
    /* The runner's: */
    struct flight *delayed; /* to be written again */
    uint32_t in_flight;
    uint64_t served, expiry_due_ns, beat_due_ns, open_due_ns, record_due_ns;
    uint64_t bytes; /* of all files, nearly */
};

void jobs_tell(struct jobs *jobs, const uint8_t *id, enum job_news news); /* id NULL: all */
/* The runner has something to do. */
void jobs_wake(struct jobs *jobs);
/* When a job that ends now is to be removed. */
int64_t jobs_expiry_s(const struct jobs *jobs);
struct running *jobs_make_running(struct jobs *jobs, const struct job *job, struct job_plan *plan);
void jobs_free_running(struct running *running); /* NULL is fine */
