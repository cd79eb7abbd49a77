#include "renderer/trace/parallel.h"
#include "protocol/container.h"
#include <pthread.h>
#include <sched.h>
#include <stdatomic.h>
#include <time.h>
#ifdef __SSE__
#include <xmmintrin.h>
#endif

#define MAX_THREADS 256

struct crew {
    struct pen_trace_crew held_by; /* who shows something meanwhile */
    const struct trace_work *work;
    _Atomic uint32_t next;
    /* The caller's thread is away: whoever has done an item waits until it is back. */
    atomic_bool held;
    pthread_mutex_t lock;
    pthread_cond_t back;
};

struct member {
    struct crew *crew;
    bool leads; /* the caller's thread */
    bool ok;
    double cpu_seconds;
};

static double seconds_of(clockid_t clock)
{
    struct timespec t;
    clock_gettime(clock, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

double trace_seconds(void)
{
    return seconds_of(CLOCK_MONOTONIC);
}

uint32_t trace_thread_count(uint32_t threads)
{
    if (threads == 0) {
        cpu_set_t set;
        threads = sched_getaffinity(0, sizeof set, &set) ? 1 : (uint32_t)CPU_COUNT(&set);
    }
    return threads < MAX_THREADS ? threads : MAX_THREADS;
}

static void hold(struct crew *crew, bool held)
{
    pthread_mutex_lock(&crew->lock);
    atomic_store(&crew->held, held);
    pthread_mutex_unlock(&crew->lock);
    if (!held)
        pthread_cond_broadcast(&crew->back);
}

static void hold_all(struct pen_trace_crew *held_by, bool held)
{
    hold(container_of(held_by, struct crew, held_by), held);
}

static void wait_for_leader(struct crew *crew)
{
    if (!atomic_load_explicit(&crew->held, memory_order_relaxed))
        return;
    pthread_mutex_lock(&crew->lock);
    while (atomic_load(&crew->held))
        pthread_cond_wait(&crew->back, &crew->lock);
    pthread_mutex_unlock(&crew->lock);
}

/* The others end what they are at meanwhile, and do not notice when this is soon back. False: nothing
 * more is wanted. */
static bool take_turn(struct crew *crew)
{
    hold(crew, true);
    bool ok = crew->work->turn(crew->work->context);
    if (!ok)
        atomic_store(&crew->next, crew->work->count);
    hold(crew, false);
    return ok;
}

/* As the caller's thread is elsewhere: not as one that traces. */
static bool begin(struct crew *crew)
{
    const struct trace_work *work = crew->work;
    bool ok = !work->beside || work->beside(work->context, &crew->held_by);
    if (!ok)
        atomic_store(&crew->next, work->count);
    return ok;
}

static bool lead(struct crew *crew)
{
    const struct trace_work *work = crew->work;
    double began = trace_seconds(), before = began;
    for (uint32_t item; (item = atomic_fetch_add(&crew->next, 1)) < work->count;) {
        work->run(work->context, item);
        double now = work->turn ? trace_seconds() : 0;
        /* The next one would not end in time. */
        bool over = work->turn && 1e3 * (2 * now - before - began) >= work->turn_ms;
        before = now;
        if (!over)
            continue;
        if (!take_turn(crew))
            return false;
        began = before = trace_seconds();
    }
    return true;
}

static void follow(struct crew *crew)
{
    const struct trace_work *work = crew->work;
    for (uint32_t item;
         wait_for_leader(crew), (item = atomic_fetch_add(&crew->next, 1)) < work->count;)
        work->run(work->context, item);
}

static void *run_member(void *argument)
{
    struct member *member = argument;
    member->ok = !member->leads || begin(member->crew);
    double start = seconds_of(CLOCK_THREAD_CPUTIME_ID);
#ifdef __SSE__
    unsigned control = _mm_getcsr();
    _mm_setcsr(control | 0x8040); /* flush denormals: Embree is slow on them */
#endif
    if (member->leads)
        member->ok = member->ok && lead(member->crew);
    else
        follow(member->crew);
#ifdef __SSE__
    _mm_setcsr(control);
#endif
    member->cpu_seconds = seconds_of(CLOCK_THREAD_CPUTIME_ID) - start;
    return NULL;
}

bool trace_parallel(uint32_t threads, const struct trace_work *work, double *cpu_seconds)
{
    struct crew crew = {
        {hold_all}, work, 0, false, PTHREAD_MUTEX_INITIALIZER, PTHREAD_COND_INITIALIZER};
    struct member members[MAX_THREADS];
    pthread_t handles[MAX_THREADS];
    if (threads > work->count)
        threads = work->count;
    uint32_t started = 0;
    for (; started + 1 < threads; started++) {
        members[started] = (struct member){&crew, false, true, 0};
        if (pthread_create(&handles[started], NULL, run_member, &members[started]))
            break; /* fewer hands, same result */
    }
    struct member own = {&crew, true, true, 0};
    run_member(&own);
    *cpu_seconds += own.cpu_seconds;
    for (uint32_t i = 0; i < started; i++) {
        pthread_join(handles[i], NULL);
        *cpu_seconds += members[i].cpu_seconds;
    }
    pthread_cond_destroy(&crew.back);
    pthread_mutex_destroy(&crew.lock);
    return own.ok;
}
