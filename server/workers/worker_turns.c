#include "server/workers/worker_turns.h"
#include "protocol/memory.h"
#include "server/base/clock.h"
#include <math.h>
#include <stdlib.h>

#define CLIENTS 64 /* whose time is remembered */
/* A render that has only begun is not interrupted by its equals: if all are short, each is done
 * sooner when they come one after the other. */
#define UNDISTURBED_MS 100.0
/* What a client who was away may use before those who were there all the time get their share. */
#define CREDIT_MS 1000.0
#define PART_SHARE 0.06 /* of a render's time, for pictures of it on the way */
#define BATCH_COST 8.0  /* a batch's time counts so many times */

struct client {
    uint64_t id; /* 0: unused */
    double used_ms;
    uint64_t last_ns;
};

struct turn {
    struct worker_turns *turns;
    struct pen_render *render; /* NULL: unused */
    struct worker_item *item;
    uint64_t client, arrived;
    bool batch;
    double ms;
};

struct worker_turns {
    struct pen_renderer *renderer;
    struct turn turns[PEN_MAX_RENDERS];
    struct turn *current; /* who had or has the turn; NULL: none */
    struct client clients[CLIENTS];
    uint64_t arrivals;
    void (*on_part)(void *context, struct worker_item *part);
    void *context;
};

struct worker_turns *worker_turns_create(struct pen_renderer *renderer,
    void (*on_part)(void *context, struct worker_item *part), void *context)
{
    struct worker_turns *t = pen_alloc_zero(1, sizeof *t);
    t->renderer = renderer;
    t->on_part = on_part;
    t->context = context;
    return t;
}

static bool wants_part(void *context)
{
    const struct turn *turn = context;
    return turn->item->part_wanted;
}

static void show_part(void *context, const struct pen_frame *frame, const struct pen_result *result)
{
    struct turn *turn = context;
    struct worker_item *part = pen_alloc(1, sizeof *part);
    *part = *turn->item;
    turn->item->part_wanted = false;
    part->message.kind = CHANNEL_PART;
    part->message.result = *result;
    part->reference_fd = -1;
    part->frame = *frame;
    turn->turns->on_part(turn->turns->context, part);
}

static struct worker_item *finish(struct worker_turns *t, struct turn *turn)
{
    struct worker_item *item = turn->item;
    struct pen_result *result = &item->message.result;
    if (!pen_render_end(turn->render, &result->error) && result->error.code == PEN_OK)
        pen_fail(&result->error, PEN_INTERNAL, "", "The render failed without saying why.");
    result->turns_ms = turn->ms;
    if (t->current == turn)
        t->current = NULL;
    *turn = (struct turn){0};
    return item;
}

void worker_turns_destroy(struct worker_turns *t)
{
    if (!t)
        return;
    for (uint32_t i = 0; i < PEN_MAX_RENDERS; i++)
        if (t->turns[i].render)
            free(finish(t, &t->turns[i]));
    free(t);
}

/* The client's account; made of the one that was unused for longest when there is none. */
static struct client *account(struct worker_turns *t, uint64_t id)
{
    struct client *oldest = &t->clients[0];
    for (uint32_t i = 0; i < CLIENTS; i++) {
        if (t->clients[i].id == id)
            return &t->clients[i];
        if (t->clients[i].last_ns < oldest->last_ns)
            oldest = &t->clients[i];
    }
    *oldest = (struct client){.id = id};
    return oldest;
}

/* The least that a client with something in progress has used; < 0: nothing is. */
static double least_used(struct worker_turns *t)
{
    double least = -1;
    for (uint32_t i = 0; i < PEN_MAX_RENDERS; i++) {
        if (!t->turns[i].render)
            continue;
        double used = account(t, t->turns[i].client)->used_ms;
        least = least < 0 ? used : fmin(least, used);
    }
    return least;
}

bool worker_turns_begin(struct worker_turns *t, const struct pen_request *request, uint64_t client,
    struct worker_item *item)
{
    struct pen_result *result = &item->message.result;
    struct turn *turn = NULL;
    for (uint32_t i = 0; i < PEN_MAX_RENDERS && !turn; i++)
        turn = t->turns[i].render ? NULL : &t->turns[i];
    double least = least_used(t);
    bool batch = request->delivery.priority == PEN_PRIORITY_BATCH;
    struct pen_error error = {0};
    struct pen_render *render =
        turn ? pen_render_begin(t->renderer, request, &item->frame, result, &error) : NULL;
    if (!render) {
        if (error.code == PEN_OK)
            pen_fail(&error, PEN_INTERNAL, "", "The worker has no room for another render.");
        result->error = error;
        return false;
    }
    uint64_t number = ++t->arrivals;
    if (item->measure == MEASURE_PICTURE)
        pen_render_watch(render, &(struct pen_viewer){wants_part, show_part, turn, PART_SHARE});
    if (item->measure == MEASURE_PICTURE)
        pen_render_limit(
            render, request->delivery.budget_ms, (double)item->best_until_ns / CLOCK_MS);
    *turn = (struct turn){.turns = t,
        .render = render,
        .item = item,
        .client = client ? client : ~number, /* nobody has such a number */
        .arrived = number,
        .batch = batch};
    struct client *c = account(t, turn->client);
    c->last_ns = clock_now_ns();
    if (least >= 0)
        c->used_ms = fmax(c->used_ms, least - (batch ? 0 : CREDIT_MS));
    return true;
}

static bool comes_before(struct worker_turns *t, const struct turn *a, const struct turn *b)
{
    if (a->client == b->client) {
        if (a->batch != b->batch)
            return b->batch;
        /* What has had least goes first: short ones are done before long ones, seen from whichever
         * side they came. */
        double had[] = {floor(a->ms / UNDISTURBED_MS), floor(b->ms / UNDISTURBED_MS)};
        return had[0] != had[1] ? had[0] < had[1] : a->arrived < b->arrived;
    }
    double used[] = {account(t, a->client)->used_ms, account(t, b->client)->used_ms};
    return used[0] != used[1] ? used[0] < used[1] : a->arrived < b->arrived;
}

uint64_t worker_turns_next(struct worker_turns *t)
{
    struct turn *best = NULL;
    bool interactive = false;
    for (uint32_t i = 0; i < PEN_MAX_RENDERS; i++) {
        struct turn *turn = &t->turns[i];
        if (!turn->render)
            continue;
        interactive |= !turn->batch;
        if (!best || comes_before(t, turn, best))
            best = turn;
    }
    bool stays =
        t->current && t->current->ms < UNDISTURBED_MS && (!t->current->batch || !interactive);
    if (!stays)
        t->current = best;
    return t->current ? t->current->item->message.job : 0;
}

struct worker_item *worker_turns_run(struct worker_turns *t)
{
    struct turn *turn = t->current;
    uint64_t start = clock_now_ns();
    bool ended = pen_render_advance(turn->render, WORKER_TURN_MS);
    double ms = clock_ms(clock_now_ns() - start);
    struct client *c = account(t, turn->client);
    turn->ms += ms;
    c->used_ms += turn->batch ? BATCH_COST * ms : ms;
    c->last_ns = clock_now_ns();
    if (ended)
        return finish(t, turn);
    bool late = turn->item->best_until_ns && clock_now_ns() > turn->item->best_until_ns;
    if (!late || turn->item->message.result.progress.done)
        return NULL;
    struct worker_item *item = finish(t, turn);
    worker_item_refuse_late(item);
    return item;
}

struct worker_item *worker_turns_cancel(struct worker_turns *t, uint64_t job)
{
    for (uint32_t i = 0; i < PEN_MAX_RENDERS; i++)
        if (t->turns[i].render && t->turns[i].item->message.job == job)
            return finish(t, &t->turns[i]);
    return NULL;
}

void worker_turns_want(struct worker_turns *t, uint64_t job)
{
    for (uint32_t i = 0; i < PEN_MAX_RENDERS; i++)
        if (t->turns[i].render && t->turns[i].item->message.job == job)
            t->turns[i].item->part_wanted = true;
}
