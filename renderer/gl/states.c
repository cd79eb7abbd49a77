#include "renderer/gl/states.h"

uint32_t gl_states_name(struct gl_states *states, uint64_t key)
{
    uint32_t known = states->count < GL_STATES_KNOWN ? states->count : GL_STATES_KNOWN, i = 0;
    while (i < known && states->keys[i] != key)
        i++;
    if (i == known && i < GL_STATES_KNOWN)
        states->keys[i] = key;
    states->count += i == known && states->count <= GL_STATES_KNOWN;
    return i;
}

bool gl_states_is_new(const struct gl_states *states, uint32_t state, GLuint program)
{
    for (int i = 0; i < GL_STATES_PROGRAMS && states->count <= GL_STATES_KNOWN; i++)
        if (states->programs[i] == program)
            return !(states->drawn[i] >> state & 1);
    return true;
}

void gl_states_is_drawn(struct gl_states *states, uint32_t state, GLuint program)
{
    if (states->count > GL_STATES_KNOWN)
        return;
    uint32_t at = 0;
    while (at < GL_STATES_PROGRAMS && states->programs[at] != program)
        at++;
    if (at == GL_STATES_PROGRAMS) {
        at = states->next++ % GL_STATES_PROGRAMS;
        states->programs[at] = program;
        states->drawn[at] = 0;
    }
    states->drawn[at] |= 1ull << state;
}
