/* How far a picture is: which of its estimates are shown, when it has to end, and how far off it may
 * be. */
#pragma once
#include "renderer/frame/job.h"

#define PROGRESS_UNITS (PEN_MAX_LIGHTS * 6) /* faces of lights */

struct frame_progress {
    const struct frame_job *job;
    uint32_t lights, faces;   /* of all lights together */
    bool tracked;             /* estimates of its error are wanted */
    bool stopped;             /* before the last sample */
    bool begun;               /* there is an estimate */
    bool late;                /* there was none in time */
    double begun_ms;          /* gl_now_ms */
    double ahead_ms;          /* of the render's own time, before the first sample */
    double extra_ms;          /* that pictures and estimates took, of the render's own time */
    double last_extra_ms;     /* the last of them */
    double step_ms;           /* the render's time at the last step, */
    double increment_ms;      /* and between the last two */
    uint32_t shown;           /* pictures */
    uint32_t frames;          /* jittered ones that are complete */
    uint32_t done, total;     /* samples of the frame at hand, the mean of its lights */
    uint32_t units, sketched; /* see frame_progress_sketch; 0: none */
    uint32_t unit, own;       /* the one at hand, and its samples */
    /* Of each unit, the variance of one sample, which the mean visibility has of it; 0: not known. */
    double unit_squares[PROGRESS_UNITS];
    /* The mean visibility after so many samples, in targets->means[]: as it is now, and an earlier
     * one to compare it with. */
    uint32_t now, now_done, kept, kept_done; /* done 0: none */
    uint32_t kept_unit, kept_own;            /* which unit's samples it lacks, and has */
    float standard_error;                    /* < 0: not estimated */
    bool show_wanted;
};

void frame_progress_begin(
    struct frame_progress *p, const struct frame_job *job, uint32_t lights, uint32_t faces);
/* Somebody would like to see something now, and the picture takes long and has nothing to show
 * before its first frame is complete but a sketch. */
bool frame_progress_wants_sketch(const struct frame_progress *p);
/* Somebody may want what is not complete. */
bool frame_progress_is_limited(const struct frame_progress *p);
/* Of each of so many lights or faces of one there are a few samples. */
void frame_progress_sketch(struct frame_progress *p, uint32_t units, uint32_t samples);
/* Sets a method's parameters to those of its sketch; false: they already are, or it has none. */
bool frame_progress_lower(const struct technique *technique, uint32_t *params);
/* There is such a sketch. Until `on` is false passes fail when the time is up (turns.stopped). */
void frame_progress_sketched(struct frame_progress *p, double sketch_ms, bool on);
/* What is to be done with an estimate from `done` of `total` samples of light or face `unit` of the
 * frame at hand. */
enum technique_step frame_progress_step(
    struct frame_progress *p, uint32_t unit, uint32_t done, uint32_t total);
/* Another jittered frame is complete; STEP_STOP: there is no time for the next one. */
enum technique_step frame_progress_next(struct frame_progress *p);
/* vis holds an estimate for all lights: takes its mean in, and estimates the error from what it
 * differs from an earlier one. */
bool frame_progress_compare(struct frame_progress *p, struct pen_error *error);
/* All since the last step was spent on a picture or an estimate. */
void frame_progress_spent(struct frame_progress *p);
/* The time that the render has had so far. */
double frame_progress_ms(const struct frame_progress *p);
/* Says in the result how far the next picture got. */
void frame_progress_tell(struct frame_progress *p, struct pen_result *result);
/* The same of the last one, with a warning where that is not the end. */
void frame_progress_end(struct frame_progress *p, struct pen_result *result);
