#include "server/workers/worker_turns.h"
#include "protocol/memory.h"
#include "server/base/clock.h"
#include "server/queue/turn_order.h"
#include <stdlib.h>

#define PART_SHARE 0.06 /* of a render's time, for pictures of it on the way */

struct turn {
    struct turn_order order; /* first: found again from it */
    struct account *account; /* the order's */
    struct worker_turns *turns;
    struct pen_render *render; /* NULL: unused */
    struct worker_item *item;
};

struct worker_turns {
    struct pen_renderer *renderer;
    struct turn turns[PEN_MAX_RENDERS];
    struct turn *current; /* who had or has the turn; NULL: none */
    struct accounts *accounts;
    uint64_t arrivals;
    void (*on_part)(void *context, struct worker_item *part);
    void *context;
};

struct worker_turns *worker_turns_create(struct pen_renderer *renderer,
    void (*on_part)(void *context, struct worker_item *part), void *context)
{
    struct worker_turns *t = pen_alloc_zero(1, sizeof *t);
    t->renderer = renderer;
    t->accounts = accounts_create();
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
    result->turns_ms = turn->order.ms;
    accounts_leave(t->accounts, turn->account, clock_now_ns());
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
    accounts_destroy(t->accounts);
    free(t);
}

bool worker_turns_begin(struct worker_turns *t, const struct pen_request *request, uint64_t client,
    struct worker_item *item)
{
    struct pen_result *result = &item->message.result;
    struct turn *turn = NULL;
    for (uint32_t i = 0; i < PEN_MAX_RENDERS && !turn; i++)
        turn = t->turns[i].render ? NULL : &t->turns[i];
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
    if (item->measure == MEASURE_PICTURE && !item->fresh)
        pen_render_continue(render);
    struct account *account =
        accounts_enter(t->accounts, client ? client : ~number, /* nobody is called so */
            batch, clock_now_ns());
    *turn = (struct turn){.order = {.account = account, .arrived = number},
        .account = account,
        .turns = t,
        .render = render,
        .item = item};
    return true;
}

uint64_t worker_turns_next(struct worker_turns *t)
{
    const struct turn_order *orders[PEN_MAX_RENDERS];
    uint32_t count = 0;
    for (uint32_t i = 0; i < PEN_MAX_RENDERS; i++)
        if (t->turns[i].render)
            orders[count++] = &t->turns[i].order;
    /* The order is a turn's first member. */
    t->current =
        (struct turn *)turn_order_next(orders, count, t->current ? &t->current->order : NULL);
    return t->current ? t->current->item->message.job : 0;
}

struct pen_place worker_turns_place(const struct worker_turns *t)
{
    return pen_render_place(t->current->render);
}

struct worker_item *worker_turns_run(struct worker_turns *t)
{
    struct turn *turn = t->current;
    uint64_t start = clock_now_ns();
    bool ended = pen_render_advance(turn->render, WORKER_TURN_MS);
    double ms = clock_ms(clock_now_ns() - start);
    turn->order.ms += ms;
    accounts_charge(t->accounts, turn->account, ms);
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
