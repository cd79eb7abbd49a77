#include "server/queue/accounts.h"
#include "protocol/memory.h"
#include <math.h>
#include <stdlib.h>

#define MOST_IDLE 64 /* accounts without renders */
/* What a client who was away may use before those who were there all the time get their share. */
#define CREDIT_MS 1000.0
/* All new clients together count as so many: names cost nothing. One is new until it has used
 * CREDIT_MS. */
#define NEWCOMERS_WORTH 4.0

struct accounts {
    struct account *first;
    uint32_t idle;
    double floor_ms;     /* the least that anybody present had used; never less than it was */
    double newcomers_ms; /* what they have used, as one account of that worth */
};

struct accounts *accounts_create(void)
{
    struct accounts *a = pen_alloc_zero(1, sizeof *a);
    return a;
}

void accounts_destroy(struct accounts *a)
{
    while (a && a->first) {
        struct account *account = a->first;
        a->first = account->next;
        free(account);
    }
    free(a);
}

static void raise_floor(struct accounts *a)
{
    double least = INFINITY;
    for (const struct account *c = a->first; c; c = c->next)
        if (c->present)
            least = fmin(least, c->used_ms);
    if (least < INFINITY)
        a->floor_ms = fmax(a->floor_ms, least);
}

static void drop_oldest_idle(struct accounts *a)
{
    struct account **oldest = NULL;
    for (struct account **at = &a->first; *at; at = &(*at)->next)
        if (!(*at)->present && (!oldest || (*at)->last_ns < (*oldest)->last_ns))
            oldest = at;
    if (!oldest)
        return;
    struct account *account = *oldest;
    *oldest = account->next;
    free(account);
    a->idle--;
}

struct account *accounts_enter(struct accounts *a, uint64_t client, bool batch, uint64_t now_ns)
{
    struct account *account = a->first;
    while (account && (account->client != client || account->batch != batch))
        account = account->next;
    bool is_new = !account, comes = is_new || !account->present;
    if (is_new) {
        account = pen_alloc_zero(1, sizeof *account);
        *account = (struct account){.next = a->first, .client = client, .batch = batch};
        a->first = account;
    } else if (comes) {
        a->idle--;
    }
    /* Batches have nothing in hand, and begin behind those who have. */
    if (is_new && batch) {
        account->used_ms = a->floor_ms + CREDIT_MS;
    } else if (is_new) {
        a->newcomers_ms = fmax(a->newcomers_ms, a->floor_ms - CREDIT_MS);
        account->used_ms = a->newcomers_ms;
        account->new_ms = CREDIT_MS;
    } else if (comes) {
        account->used_ms = fmax(account->used_ms, a->floor_ms - (batch ? 0 : CREDIT_MS));
    }
    account->present++;
    account->last_ns = now_ns;
    return account;
}

void accounts_leave(struct accounts *a, struct account *account, uint64_t now_ns)
{
    account->last_ns = now_ns;
    if (--account->present)
        return;
    raise_floor(a);
    if (++a->idle > MOST_IDLE)
        drop_oldest_idle(a);
}

void accounts_charge(struct accounts *a, struct account *account, double ms)
{
    account->used_ms += account->batch ? ACCOUNTS_BATCH_COST * ms : ms;
    if (account->new_ms > 0) {
        a->newcomers_ms += ms / NEWCOMERS_WORTH;
        account->new_ms -= ms;
    }
    raise_floor(a);
}

struct account *accounts_first(const struct accounts *a)
{
    return a->first;
}
