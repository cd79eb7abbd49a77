#include "renderer/gl/timer.h"
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

#define ROOM (sizeof((struct gl_timer *)0)->passes / sizeof((struct gl_timer *)0)->passes[0])

static uint32_t waits; /* there is one GL thread */

void gl_wait(void)
{
    gl.Finish();
    waits++;
}

GLenum gl_take_error(void)
{
    GLenum worst = GL_NO_ERROR, error;
    /* A lost context may go on telling of it. */
    for (int i = 0; i < 16 && (error = gl.GetError()) != GL_NO_ERROR; i++)
        if (worst == GL_NO_ERROR || error == GL_OUT_OF_MEMORY || error == GL_CONTEXT_LOST)
            worst = error;
    return worst;
}

uint32_t gl_waits(void)
{
    return waits;
}

static double read_clock(clockid_t clock)
{
    struct timespec t;
    clock_gettime(clock, &t);
    return 1e3 * (double)t.tv_sec + 1e-6 * (double)t.tv_nsec;
}

double gl_now_ms(void)
{
    return read_clock(CLOCK_MONOTONIC);
}

struct gl_stopwatch gl_stopwatch_start(void)
{
    return (struct gl_stopwatch){gl_now_ms(), read_clock(CLOCK_PROCESS_CPUTIME_ID)};
}

double gl_stopwatch_ms(const struct gl_stopwatch *watch)
{
    double worked = read_clock(CLOCK_PROCESS_CPUTIME_ID) - watch->worked_ms;
    return fmax(fmin(gl_now_ms() - watch->ms, worked), 1e-3);
}

void gl_timer_init(struct gl_timer *timer, bool software)
{
    memset(timer, 0, sizeof *timer);
    timer->software = software;
}

void gl_timer_finish(struct gl_timer *timer)
{
    for (uint32_t i = 0; i < ROOM; i++)
        if (timer->passes[i].queries[0])
            gl.DeleteQueries(2, timer->passes[i].queries);
    memset(timer, 0, sizeof *timer);
}

void gl_timer_reset(struct gl_timer *timer)
{
    timer->count = timer->depth = 0;
}

void gl_timer_begin(struct gl_timer *timer, enum pen_stage stage, const char *name)
{
    if (timer->count == ROOM || timer->depth == GL_TIMER_DEPTH) {
        timer->depth++;
        return;
    }
    uint32_t i = timer->count++;
    snprintf(timer->passes[i].name, sizeof timer->passes[i].name, "%s", name);
    timer->passes[i].stage = stage;
    timer->passes[i].again = false;
    timer->passes[i].parent = timer->depth ? (int32_t)timer->open[timer->depth - 1] : -1;
    timer->open[timer->depth] = i;
    timer->nested_ms[timer->depth] = 0;
    if (timer->software) {
        gl_wait();
        timer->begun_ms[timer->depth] = gl_now_ms();
    } else {
        if (!timer->passes[i].queries[0])
            gl.CreateQueries(GL_TIMESTAMP, 2, timer->passes[i].queries);
        gl.QueryCounter(timer->passes[i].queries[0], GL_TIMESTAMP);
    }
    timer->depth++;
}

void gl_timer_end(struct gl_timer *timer)
{
    timer->depth--;
    if (timer->depth >= GL_TIMER_DEPTH || timer->open[timer->depth] >= timer->count)
        return;
    uint32_t i = timer->open[timer->depth];
    if (!timer->software) {
        gl.QueryCounter(timer->passes[i].queries[1], GL_TIMESTAMP);
        return;
    }
    gl_wait();
    double total = gl_now_ms() - timer->begun_ms[timer->depth];
    timer->passes[i].ms = total - timer->nested_ms[timer->depth];
    if (timer->depth)
        timer->nested_ms[timer->depth - 1] += total;
}

static uint32_t open_count(const struct gl_timer *timer)
{
    return timer->depth < GL_TIMER_DEPTH ? timer->depth : GL_TIMER_DEPTH;
}

void gl_timer_stop(struct gl_timer *timer)
{
    timer->stopped_ms = gl_now_ms();
    for (uint32_t d = open_count(timer); !timer->software && d-- > 0;)
        gl.QueryCounter(timer->passes[timer->open[d]].queries[1], GL_TIMESTAMP);
}

/* A device's time stamps cannot leave anything out, so each open pass goes on as a new entry. */
static void open_again(struct gl_timer *timer, uint32_t d)
{
    uint32_t before = timer->open[d], i = timer->count;
    if (i == ROOM)
        return;
    timer->count++;
    memcpy(timer->passes[i].name, timer->passes[before].name, sizeof timer->passes[i].name);
    timer->passes[i].stage = timer->passes[before].stage;
    timer->passes[i].again = true;
    timer->passes[i].parent = d ? (int32_t)timer->open[d - 1] : -1;
    timer->open[d] = i;
    if (!timer->passes[i].queries[0])
        gl.CreateQueries(GL_TIMESTAMP, 2, timer->passes[i].queries);
    gl.QueryCounter(timer->passes[i].queries[0], GL_TIMESTAMP);
}

void gl_timer_go_on(struct gl_timer *timer)
{
    double away = gl_now_ms() - timer->stopped_ms;
    for (uint32_t d = 0; d < open_count(timer); d++)
        if (timer->software)
            timer->begun_ms[d] += away;
        else
            open_again(timer, d);
}

static struct pen_pass_time *find_pass(struct pen_result *result, const char *name, uint32_t stage)
{
    for (uint32_t i = 0; i < result->pass_count; i++)
        if (result->passes[i].stage == stage && !strcmp(result->passes[i].name, name))
            return &result->passes[i];
    if (result->pass_count == PEN_MAX_PASSES)
        return NULL;
    struct pen_pass_time *pass = &result->passes[result->pass_count++];
    memset(pass, 0, sizeof *pass);
    snprintf(pass->name, sizeof pass->name, "%s", name);
    pass->stage = stage;
    return pass;
}

void gl_timer_collect(struct gl_timer *timer, struct pen_result *result)
{
    if (!timer->software) {
        for (uint32_t i = 0; i < timer->count; i++) {
            GLuint64 from = 0, to = 0;
            gl.GetQueryObjectui64v(timer->passes[i].queries[0], GL_QUERY_RESULT, &from);
            gl.GetQueryObjectui64v(timer->passes[i].queries[1], GL_QUERY_RESULT, &to);
            timer->passes[i].ms = 1e-6 * (double)(to - from);
        }
        /* Children come after their parent, so going backwards subtracts whole subtrees once. */
        for (uint32_t i = timer->count; i-- > 0;)
            if (timer->passes[i].parent >= 0) {
                GLuint64 from = 0, to = 0;
                gl.GetQueryObjectui64v(timer->passes[i].queries[0], GL_QUERY_RESULT, &from);
                gl.GetQueryObjectui64v(timer->passes[i].queries[1], GL_QUERY_RESULT, &to);
                timer->passes[timer->passes[i].parent].ms -= 1e-6 * (double)(to - from);
            }
    }
    for (uint32_t i = 0; i < timer->count; i++) {
        uint32_t stage = timer->passes[i].stage;
        struct pen_pass_time *pass = find_pass(result, timer->passes[i].name, stage);
        result->stage_ms[stage] += (float)timer->passes[i].ms;
        if (pass) {
            pass->ms += (float)timer->passes[i].ms;
            pass->count += !timer->passes[i].again;
        }
    }
}
