/* Threads over numbered items. */
#include "renderer/trace/embree/internal.h"
#include <pthread.h>
#include <sched.h>
#include <time.h>
#ifdef __SSE__
#include <xmmintrin.h>
#endif

#define MAX_THREADS 256

struct crew {
    void (*work)(void *, uint32_t);
    void *context;
    uint32_t count;
    _Atomic uint32_t next;
};

struct member {
    struct crew *crew;
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

static void *run_member(void *argument)
{
    struct member *member = argument;
    struct crew *crew = member->crew;
    double start = seconds_of(CLOCK_THREAD_CPUTIME_ID);
#ifdef __SSE__
    unsigned control = _mm_getcsr();
    _mm_setcsr(control | 0x8040); /* flush denormals: Embree is slow on them */
#endif
    for (uint32_t item; (item = atomic_fetch_add(&crew->next, 1)) < crew->count;)
        crew->work(crew->context, item);
#ifdef __SSE__
    _mm_setcsr(control);
#endif
    member->cpu_seconds = seconds_of(CLOCK_THREAD_CPUTIME_ID) - start;
    return NULL;
}

void trace_parallel(uint32_t threads, uint32_t count, void (*work)(void *context, uint32_t item),
    void *context, double *cpu_seconds)
{
    struct crew crew = {work, context, count, 0};
    struct member members[MAX_THREADS];
    pthread_t handles[MAX_THREADS];
    if (threads > count)
        threads = count;
    uint32_t started = 0;
    for (; started + 1 < threads; started++) {
        members[started] = (struct member){&crew, 0};
        if (pthread_create(&handles[started], NULL, run_member, &members[started]))
            break; /* fewer hands, same result */
    }
    struct member own = {&crew, 0};
    run_member(&own);
    *cpu_seconds += own.cpu_seconds;
    for (uint32_t i = 0; i < started; i++) {
        pthread_join(handles[i], NULL);
        *cpu_seconds += members[i].cpu_seconds;
    }
}
