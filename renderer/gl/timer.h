/* What every pass costs: GPU timestamps, or on software GL wall clock between finishes (its timer
 * queries do not see deferred rasterisation). */
#pragma once
#include "protocol/result.h"
#include "renderer/gl/gl.h"

#define GL_TIMER_DEPTH 8

struct gl_timer {
    bool software;
    uint32_t count, depth;
    uint32_t open[GL_TIMER_DEPTH]; /* indices of passes that have begun */
    double begun_ms[GL_TIMER_DEPTH], nested_ms[GL_TIMER_DEPTH];
    double stopped_ms;
    struct {
        char name[24];
        uint32_t stage;
        GLuint queries[2];
        double ms; /* software; exclusive of passes inside it */
        int32_t parent;
        bool again; /* goes on with an earlier entry */
    } passes[PEN_MAX_PASSES * 8];
};

void gl_timer_init(struct gl_timer *timer, bool software);
void gl_timer_finish(struct gl_timer *timer);

/* A new frame: forgets all passes. */
void gl_timer_reset(struct gl_timer *timer);
/* Passes may nest; time spent in an inner pass is not counted in the outer one. */
void gl_timer_begin(struct gl_timer *timer, enum pen_stage stage, const char *name);
void gl_timer_end(struct gl_timer *timer);
/* In between other frames may be drawn; their time does not count. */
void gl_timer_stop(struct gl_timer *timer);
void gl_timer_go_on(struct gl_timer *timer);
/* Waits for the results and adds them up by name into result->passes and result->stage_ms. */
void gl_timer_collect(struct gl_timer *timer, struct pen_result *result);

double gl_now_ms(void); /* monotonic */

/* Until all is done that was handed over to the device; and how often that was done. */
void gl_wait(void);
/* OpenGL's error since the last call, GL_NO_ERROR if there was none; of several that of memory or of
 * a lost context. */
GLenum gl_take_error(void);
uint32_t gl_waits(void);

/* How long work takes, for who cuts it: where other processes are on the processors too, not longer
 * than what all threads of this one have worked. */
struct gl_stopwatch {
    double ms, worked_ms;
};
struct gl_stopwatch gl_stopwatch_start(void);
double gl_stopwatch_ms(const struct gl_stopwatch *watch); /* above 0 */
