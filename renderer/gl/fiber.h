/* A call with a stack of its own that can stop in the middle and go on later, always on the thread
 * that resumes it: GL calls inside find the context that is current there. */
#pragma once
#include <stdbool.h>

struct gl_fiber;

/* Never fails short of memory for a stack, which ends the process. */
struct gl_fiber *gl_fiber_create(void);
/* One that has ended, or never begun. NULL is fine. */
void gl_fiber_destroy(struct gl_fiber *fiber);
/* The next resume calls run(context). Only when the last call has ended. */
void gl_fiber_begin(struct gl_fiber *fiber, void (*run)(void *context), void *context);
/* Goes on until the next pause. True when the call has ended. */
bool gl_fiber_resume(struct gl_fiber *fiber);
/* From inside: back to who resumed it. */
void gl_fiber_pause(struct gl_fiber *fiber);
