/* The bounded queue between connections and workers. A render is one unit of work; every client
 * that asks for the same picture at the same time waits on the same render. */
#pragma once
#include "protocol/request.h"
#include "server/queue/accounts.h"
#include "server/queue/estimates.h"
#include "server/queue/measure.h"
#include "server/store/picture.h"

/* How a render ended for one client. */
struct outcome {
    struct pen_error error;  /* PEN_OK: there is a picture */
    struct picture *picture; /* borrowed for the call */
    double queue_ms, run_ms; /* before and after a worker took it */
    bool shared;             /* another client's request rendered it */
    /* Of measurements, borrowed like the picture: */
    const struct pen_result *result;    /* also when nothing was encoded */
    int planes_fd;                      /* of a reference; 0: none */
    struct picture *maps[MEASURE_MAPS]; /* enum measure_map; NULL: none */
};

/* One client waiting. The owner keeps it alive from a successful scheduler_submit until `finish`,
 * which is called exactly once, from any thread, with no lock held. */
struct waiter {
    struct waiter *next;
    uint64_t deadline_ns;                   /* monotonic */
    uint64_t client;                        /* whose share it uses; 0: nobody's */
    uint64_t payer;                         /* whose time it takes; 0: the client's */
    const char *request_id;                 /* for the log; NULL: none; copied */
    bool (*is_gone)(struct waiter *waiter); /* the client has hung up; may be NULL */
    void (*finish)(struct waiter *waiter, const struct outcome *outcome);
    bool fresh; /* nothing that is there of its picture already is used */
    bool best;  /* at the deadline a worker that has begun with it gives what there is */
    /* A picture so far, borrowed for the call, when one is wanted; before `finish`, from any thread,
     * with no lock held. NULL: only the end matters. */
    void (*part)(struct waiter *waiter, struct picture *picture);
    bool wants_part;  /* the scheduler's, after scheduler_submit; false again with each `part` */
    uint32_t measure; /* enum measure; what is measured is never shared */
    int reference_fd; /* planes to compare with, needed until scheduler_submit returns; 0: none */
    /* What will be asked for when this is done, each `continues` what was let in with the first of
     * them: not refused for what others ask for, and made before what waits to be begun. Needed
     * until scheduler_submit returns. */
    const struct pen_request *following;
    uint32_t following_count;
    bool continues;
    /* Its owner bounds how many of these there are: they take nobody's place in the queue, and are not
     * refused for a full one. */
    bool background;
};

struct render {
    struct render *next;
    uint64_t id;
    struct pen_request request;
    uint8_t key[PEN_ID_BYTES];
    struct waiter *waiters;
    uint64_t queued_ns, taken_ns;
    uint64_t last_deadline_ns;
    uint64_t best_until_ns; /* of a waiter who takes what there is; 0: there is none */
    bool shareable, running, batch, fresh, continues, background;
    bool trial; /* let in to see whether it is as late as it seems */
    uint32_t measure;
    int reference_fd;                  /* the render's own; 0: none */
    uint32_t attempts, kills, starved; /* kept by the worker pool */
    char request_id[33];               /* of the one who asked first, as is: */
    uint64_t payer;                    /* whose time it takes */
    struct account *account;
    struct estimate estimate;               /* of when it was asked for */
    double following_ms, following_sure_ms; /* of what follows: likely, and at least */
    double charged_ms;                      /* to the account, before the time is known */
    uint64_t place;  /* what of the scene and its lights can be used again; see taker */
    uint32_t passed; /* how often one behind it was taken while it could not be */
    /* Of a worker that had no room for it: which, and how many renders had ended there. */
    uint32_t busy_worker;
    uint64_t busy_ended;
};

struct scheduler_limits {
    uint32_t queue, client_share, workers;
    const struct pen_catalogue *catalogue; /* for estimates; may be NULL */
    uint64_t (*now_ns)(void);              /* NULL: clock_now_ns */
};
struct scheduler;
/* `on_work(context)` is called, with no lock held, whenever there is something to take. */
struct scheduler *scheduler_create(
    const struct scheduler_limits *limits, void (*on_work)(void *context), void *context);
void scheduler_destroy(struct scheduler *scheduler); /* nothing may be queued or running */

/* Queues a request, or joins one that is queued or running when `shareable`. Errors, with the
 * waiter untouched: PEN_TOO_MANY (share used up), PEN_UNAVAILABLE (full, draining, or what comes
 * first is known to take longer than the deadline leaves), with retry_after_s. A success uses one unit of the client's share until scheduler_release. */
bool scheduler_submit(struct scheduler *scheduler, const struct pen_request *request,
    const uint8_t key[PEN_ID_BYTES], bool shareable, struct waiter *waiter,
    struct pen_error *error);
void scheduler_release(struct scheduler *scheduler, uint64_t client);

/* Whether a worker can take a render now. */
enum take {
    TAKE_FITS,
    TAKE_LATER,       /* others may go before it */
    TAKE_SCENE_LATER, /* others may, but none of its scene */
    TAKE_NOTHING      /* it has been passed too often: what is there is kept for it */
};
struct taker {
    enum take (*fits)(void *context, struct render *render); /* called with the lock held */
    void *context;
    uint64_t place; /* of what it took last */
};
/* The next render that fits and that somebody still waits for; NULL: none. The client who has had
 * least of the renderer comes first, and of a client what came first; but renders of the place that
 * was taken last go before others for a short while, so that what was made for them is used again.
 * The caller gives it back with scheduler_return (to be taken again, first) or scheduler_finish. */
struct render *scheduler_take(struct scheduler *scheduler, const struct taker *taker);
/* Of one that was taken: somebody still waits for it. Once not, nobody can join it any more. */
bool scheduler_is_wanted(struct scheduler *scheduler, struct render *render);
void scheduler_return(struct scheduler *scheduler, struct render *render);
/* The waiter wants the next picture so far. It may have been finished meanwhile, but is still there.
 */
void scheduler_want_part(struct scheduler *scheduler, struct waiter *waiter);
/* Of one that was taken: somebody wants a picture so far. */
bool scheduler_wants_part(struct scheduler *scheduler, const struct render *render);
/* Shows a picture so far to those who want one. */
void scheduler_show_part(
    struct scheduler *scheduler, struct render *render, struct picture *picture);
/* Answers everybody who waits and frees the render. */
void scheduler_finish(
    struct scheduler *scheduler, struct render *render, const struct outcome *outcome);

/* Answers 504 to those whose deadline has passed; returns the next deadline, UINT64_MAX: none. */
uint64_t scheduler_expire(struct scheduler *scheduler);
/* From now on nothing is accepted. */
void scheduler_drain(struct scheduler *scheduler);
/* Answers 503 to everybody who still waits. */
void scheduler_cancel(struct scheduler *scheduler);

struct scheduler_numbers {
    uint32_t queued, running, waiting; /* renders, renders, clients */
    uint32_t background;               /* of those queued */
    uint64_t refused_full, refused_share, refused_late, expired, abandoned, shared;
    double backlog_ms; /* what is queued and running will take, as far as that is known */
    uint32_t estimates;
    bool full, draining;
};
void scheduler_read(struct scheduler *scheduler, struct scheduler_numbers *numbers);
