/* Those who wait for a render and want to see it getting better. */
#include "server/queue/scheduler_state.h"

void scheduler_put_back(struct render *render, struct waiter *list)
{
    while (list) {
        struct waiter *waiter = list;
        list = waiter->next;
        waiter->next = render->waiters;
        render->waiters = waiter;
    }
}

void scheduler_want_part(struct scheduler *s, struct waiter *waiter)
{
    pthread_mutex_lock(&s->lock);
    waiter->wants_part = true;
    pthread_mutex_unlock(&s->lock);
    s->on_work(s->context);
}

bool scheduler_wants_part(struct scheduler *s, const struct render *render)
{
    bool wants = false;
    pthread_mutex_lock(&s->lock);
    for (const struct waiter *w = render->waiters; w; w = w->next)
        wants = wants || w->wants_part;
    pthread_mutex_unlock(&s->lock);
    return wants;
}

void scheduler_show_part(struct scheduler *s, struct render *render, struct picture *picture)
{
    struct waiter *shown = NULL;
    pthread_mutex_lock(&s->lock);
    for (struct waiter **at = &render->waiters; *at;) {
        struct waiter *waiter = *at;
        if (!waiter->wants_part) {
            at = &waiter->next;
            continue;
        }
        waiter->wants_part = false;
        *at = waiter->next; /* while it is shown to them, nobody may answer them */
        waiter->next = shown;
        shown = waiter;
    }
    pthread_mutex_unlock(&s->lock);
    for (struct waiter *waiter = shown; waiter; waiter = waiter->next)
        waiter->part(waiter, picture);
    pthread_mutex_lock(&s->lock);
    scheduler_put_back(render, shown);
    pthread_mutex_unlock(&s->lock);
}
