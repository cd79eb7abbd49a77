/* How long what is asked for will take, and what comes before it, as far as that is known. */
#include "server/base/clock.h"
#include "server/queue/scheduler_state.h"
#include <math.h>

#define MOST_RETRY_S 600
#define MOST_RATIO 10.0
/* What is let in is to be done in time though the machine, and what others do on it, becomes half as fast
 * meanwhile. It costs no throughput: the queue is shorter, never empty. */
#define RESERVE 2.0

/* How many times as long as it takes of the renderer one is in the way of another: measurements of a
 * client are made one after the other, each until it is done, and whatever else is there goes on beside
 * them. */
static double ratio_of(
    const struct scheduler *s, const struct render *render, const struct render *other)
{
    bool wait = render->measure != MEASURE_PICTURE && other->measure != MEASURE_PICTURE &&
                render->payer == other->payer;
    return wait ? s->measured_ratio : 1;
}

void scheduler_learn_ratio(struct scheduler *s, double renderer_ms, double run_ms)
{
    double ratio = fmin(MOST_RATIO, fmax(1, run_ms / fmax(1, renderer_ms)));
    s->measured_ratio += 0.2 * (ratio - s->measured_ratio);
}

#define PACE_KEPT 0.95 /* of what was counted before, with every render */
#define MOST_PACE 20.0

void scheduler_pace_begin(struct scheduler *s)
{
    s->paced_ns = s->limits.now_ns();
}

void scheduler_pace(struct scheduler *s, const struct render *render, bool counts, double ms)
{
    uint64_t now = s->limits.now_ns();
    double took = clock_ms(now - s->paced_ns);
    double foreseen = render->estimate.sure * render->estimate.least_ms;
    s->paced_ns = now;
    counts &= foreseen > 0;
    took = counts ? took : fmax(0, took - ms); /* it was in the way of those that count */
    s->paced_ms = PACE_KEPT * s->paced_ms + took * s->limits.workers;
    s->foreseen_ms = PACE_KEPT * s->foreseen_ms + (counts ? foreseen : 0);
    s->paced_count = PACE_KEPT * s->paced_count + counts;
}

/* How many times as long as is known of them renders take here, one after the other: what they take
 * beside the renderer, what else the machine does, and that what is known is the least. */
static double pace(const struct scheduler *s)
{
    double one = s->foreseen_ms / fmax(1, s->paced_count); /* that would be as foreseen */
    double times = one > 0 ? (s->paced_ms + one) / (s->foreseen_ms + one) : 1;
    return fmin(MOST_PACE, fmax(1, times));
}

void scheduler_foresee(
    const struct scheduler *s, struct render *render, const struct waiter *waiter)
{
    for (uint32_t i = 0; i < waiter->following_count; i++) {
        struct estimate e = estimates_of(s->estimates, &waiter->following[i], s->limits.now_ns());
        render->following_ms += fmax(0, e.ms);
        render->following_sure_ms += e.sure * e.least_ms;
    }
}

/* What a render will still take of the renderer; of one without an estimate `unknown_ms`. None goes on
 * when nobody waits for it. */
static double left_ms(const struct scheduler *s, const struct render *r, double unknown_ms)
{
    uint64_t now = s->limits.now_ns();
    double ms = r->estimate.ms < 0 ? unknown_ms : r->estimate.ms;
    if (!r->waiters || r->last_deadline_ns < now)
        return 0;
    if (r->running) /* at most: it shared the renderer with the others */
        ms -= clock_ms(now - r->taken_ns) / fmax(1, s->numbers.running);
    ms = fmax(0, ms) + r->following_ms;
    return fmax(0, fmin(ms, clock_ms(r->last_deadline_ns - now)));
}

/* Everything that is there, on all workers together. */
double scheduler_backlog_ms(const struct scheduler *s, double unknown_ms)
{
    double ms = 0;
    for (const struct render *r = s->queue[0]; r; r = r->next)
        ms += left_ms(s, r, unknown_ms);
    for (const struct render *r = s->running; r; r = r->next)
        ms += left_ms(s, r, unknown_ms);
    return ms / fmax(1, s->limits.workers);
}

static uint32_t whole_seconds(double ms)
{
    return (uint32_t)fmin(MOST_RETRY_S, fmax(1, ceil(ms / 1e3)));
}

/* When about half of what is there is done. */
uint32_t scheduler_retry_s(const struct scheduler *s)
{
    return whole_seconds(pace(s) * scheduler_backlog_ms(s, s->mean_ms) / 2);
}

/* How long a new render will wait at least. As all are served in turn, no other client is in its way
 * for longer than its own renders take, times what the other's time counts less; of its own client's
 * those that are queued come first, and those that run give way until it has had as much. Only what
 * is known counts, and as far as it is sure. */
static double wait_ms(const struct scheduler *s, const struct render *render, double own_ms)
{
    const uint64_t payer = render->payer;
    const bool batch = render->batch;
    const struct render *lists[] = {s->queue[0], s->running};
    double mine = own_ms, ms = 0;
    for (struct account *a = accounts_first(s->accounts); a; a = a->next)
        a->backlog_ms = 0;
    for (int l = 0; l < 2; l++)
        for (const struct render *r = lists[l]; r; r = r->next) {
            double left = ratio_of(s, r, render) * r->estimate.sure * left_ms(s, r, 0);
            bool own = r->payer == payer && r->batch == batch;
            if (own) {
                left = r->running ? fmin(left, own_ms) : left;
                ms += left;
                mine += r->running ? 0 : left;
            } else {
                r->account->backlog_ms += left;
            }
        }
    for (struct account *a = accounts_first(s->accounts); a; a = a->next) {
        double times = a->batch == batch ? 1
                       : batch           ? ACCOUNTS_BATCH_COST
                                         : 1 / ACCOUNTS_BATCH_COST;
        ms += fmin(a->backlog_ms, times * mine);
    }
    return ms / fmax(1, s->limits.workers);
}

/* What comes first leaves too little of the time that the waiter has: *error says so. A render that
 * takes too long even alone is let in: its estimate may be wrong. What it takes itself, and so how far
 * others are in its way, counts only as far as like ones on its own scene have shown: others' dear
 * renders tell nothing of it. */
bool scheduler_is_late(struct scheduler *s, struct render *render, const struct waiter *waiter,
    struct pen_error *error)
{
    uint64_t now = s->limits.now_ns();
    double left = waiter->deadline_ns > now ? clock_ms(waiter->deadline_ns - now) : 0;
    double own = waiter->best ? 0 : render->estimate.sure * render->estimate.least_ms;
    own = pace(s) * ratio_of(s, render, render) * (own + render->following_sure_ms);
    double most = waiter->following_count ? left : left / 2; /* many say more than one */
    double wait = RESERVE * pace(s) * wait_ms(s, render, own / pace(s));
    double over = wait + fmin(RESERVE * own, most) - left;
    if (!(wait > 0 && over > 0))
        return false;
    render->trial = estimates_doubt(s->estimates, &render->request, now);
    if (render->trial)
        return false;
    pen_fail(error, PEN_UNAVAILABLE, "/deadline_ms",
        "What was asked for before takes about %.1f s: this would not be ready in time.",
        wait / RESERVE / 1e3);
    error->retry_after_s = whole_seconds(over / RESERVE);
    return true;
}

bool scheduler_is_hopeless(const struct scheduler *s, const struct render *render)
{
    uint64_t now = s->limits.now_ns();
    double own = render->estimate.sure * render->estimate.least_ms + render->following_sure_ms;
    double needs = ratio_of(s, render, render) * own;
    if (render->continues || render->trial || render->best_until_ns ||
        render->last_deadline_ns < now)
        return false;
    const struct render *before[] = {s->running, s->queue[0]};
    bool others = false;
    for (int l = 0; l < 2; l++)
        for (const struct render *r = before[l]; r && r != render; r = r->next)
            if (r->payer == render->payer && r->batch == render->batch) {
                needs += ratio_of(s, r, render) * r->estimate.sure * left_ms(s, r, 0) /
                         fmax(1, s->limits.workers);
                others = true;
            }
    return others && pace(s) * needs > clock_ms(render->last_deadline_ns - now);
}
