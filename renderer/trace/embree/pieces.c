/* Work on a picture's tiles that others can come in between. */
#include "renderer/trace/embree/internal.h"

bool trace_is_late(struct trace_pieces *p)
{
    uint64_t deadline = p->job->deadline_ns;
    if (deadline && trace_seconds() * 1e9 > (double)deadline)
        atomic_store(&p->late, true);
    return atomic_load(&p->late);
}

static bool take_turn(void *context)
{
    struct trace_pieces *p = context;
    if (atomic_load(&p->late) || !p->job->turn(p->job->turn_context))
        atomic_store(&p->late, true);
    return !atomic_load(&p->late);
}

static bool show_beside(void *context, struct pen_trace_crew *crew)
{
    struct trace_pieces *p = context;
    if (!p->job->shown(p->job->turn_context, crew))
        atomic_store(&p->late, true);
    return !atomic_load(&p->late);
}

bool trace_in_pieces(
    struct trace_pieces *p, uint32_t tiles, void (*work)(void *context, uint32_t item))
{
    const struct trace_work all = {work, p, tiles, p->job->turn ? take_turn : NULL, p->job->turn_ms,
        p->owes ? show_beside : NULL};
    p->owes = false;
    trace_parallel(p->threads, &all, &p->cpu_seconds);
    return !atomic_load(&p->late);
}
