/* What a driver compiles for besides a program, such as how its textures are looked up: which of these
 * states it has drawn with. A software device takes a tenth of a second and more for each. */
#pragma once
#include "renderer/gl/gl.h"
#include <stdbool.h>
#include <stdint.h>

#define GL_STATES_KNOWN 64 /* bits of `drawn` */
#define GL_STATES_PROGRAMS 24

struct gl_states { /* zeroed to begin with */
    uint64_t keys[GL_STATES_KNOWN];
    uint32_t count; /* of different states; beyond GL_STATES_KNOWN: many */
    /* Those that were drawn with some program: a bit each. */
    GLuint programs[GL_STATES_PROGRAMS];
    uint64_t drawn[GL_STATES_PROGRAMS];
    uint32_t next;
};

/* The number of a state, by what tells it from others. */
uint32_t gl_states_name(struct gl_states *states, uint64_t key);
/* Whether it may have to be compiled for with this program: it was not drawn with it, or there are so
 * many states that drivers forget. */
bool gl_states_is_new(const struct gl_states *states, uint32_t state, GLuint program);
void gl_states_is_drawn(struct gl_states *states, uint32_t state, GLuint program);
