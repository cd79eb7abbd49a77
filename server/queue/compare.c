#include "server/queue/compare.h"
#include "protocol/memory.h"
#include "server/base/clock.h"
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

struct compare {
    struct waiter waiter; /* first: found again from it */
    struct scheduler *scheduler;
    struct compare_plan plan;
    uint32_t at; /* the request that is under way */
    int planes_fd;
    struct compare_row *rows;
};

static bool is_gone(struct waiter *waiter)
{
    struct compare *c = (struct compare *)waiter;
    return c->plan.is_gone && c->plan.is_gone(c->plan.owner);
}

static bool submit(struct compare *c, struct pen_error *error)
{
    const struct pen_request *request = &c->plan.requests[c->at];
    uint8_t key[PEN_ID_BYTES];
    picture_key(request, key);
    c->waiter.client = c->at ? 0 : c->plan.client;
    c->waiter.payer = c->plan.payer ? c->plan.payer : c->plan.client;
    c->waiter.deadline_ns =
        c->plan.deadline_ns ? c->plan.deadline_ns : clock_now_ns() + c->plan.patience_ms * CLOCK_MS;
    c->waiter.measure = c->plan.measures ? c->plan.measures[c->at]
                        : c->at          ? MEASURE_COMPARED
                                         : MEASURE_REFERENCE;
    c->waiter.background = c->plan.background;
    c->waiter.continues = c->at > 0;
    c->waiter.following = request + 1;
    c->waiter.following_count = c->plan.deadline_ns ? c->plan.count - c->at - 1 : 0;
    c->waiter.fresh = true; /* what one costs is not known from adding to what is there */
    c->waiter.reference_fd = measure_has_reference(c->waiter.measure) ? c->planes_fd : 0;
    return scheduler_submit(c->scheduler, request, key, false, &c->waiter, error);
}

/* A method's own failure is its row's; anything else ends the run. */
static bool ends_all(const struct compare *c, const struct pen_error *error)
{
    return error->code != PEN_OK &&
           (!c->at || (error->code != PEN_INVALID && error->code != PEN_INTERNAL));
}

static void take(struct compare *c, const struct outcome *outcome)
{
    struct compare_row *row = &c->rows[c->at];
    if (outcome->result)
        row->result = *outcome->result;
    row->result.error = outcome->error;
    row->run_ms = outcome->run_ms;
    if (outcome->picture && c->waiter.measure != MEASURE_PICTURE)
        row->image = picture_reference(outcome->picture);
    for (int m = 0; m < MEASURE_MAPS; m++)
        if (outcome->maps[m])
            row->maps[m] = picture_reference(outcome->maps[m]);
    if (outcome->planes_fd > 0)
        c->planes_fd = fcntl(outcome->planes_fd, F_DUPFD_CLOEXEC, 3);
}

/* Any thread. */
static void finish(struct waiter *waiter, const struct outcome *outcome)
{
    struct compare *c = (struct compare *)waiter;
    struct pen_error error = outcome->error;
    take(c, outcome);
    bool over = ends_all(c, &error);
    if (!over) {
        memset(&error, 0, sizeof error);
        do
            c->at++;
        while (c->at < c->plan.count && c->plan.wants && !c->plan.wants(c->plan.owner, c, c->at));
        over = c->at == c->plan.count || !submit(c, &error);
    }
    if (over) /* else the next one may have ended everything by now: c is not ours any more */
        c->plan.done(c->plan.owner, c, &error);
}

bool compare_start(
    struct scheduler *scheduler, const struct compare_plan *plan, struct pen_error *error)
{
    struct compare *c = pen_alloc_zero(1, sizeof *c);
    struct compare_row *rows = pen_alloc_zero(plan->count, sizeof *rows);
    c->scheduler = scheduler;
    c->plan = *plan;
    c->rows = rows;
    c->waiter.is_gone = is_gone;
    c->waiter.finish = finish;
    if (submit(c, error))
        return true;
    compare_destroy(c);
    return false;
}

const struct compare_row *compare_rows(const struct compare *c)
{
    return c->rows;
}

uint32_t compare_done_count(const struct compare *c)
{
    return c->at;
}

void compare_destroy(struct compare *c)
{
    if (!c)
        return;
    for (uint32_t i = 0; i < c->plan.count; i++) {
        picture_release(c->rows[i].image);
        for (int m = 0; m < MEASURE_MAPS; m++)
            picture_release(c->rows[i].maps[m]);
    }
    if (c->planes_fd > 0)
        close(c->planes_fd);
    free(c->rows);
    free(c);
}
