/* A frame's receivers in the processor's memory, and the way back: what rays on the CPU need of
 * OpenGL. */
#pragma once
#include "renderer/passes/rays/rays.h"

struct host_picture {
    struct pen_trace_view view; /* over the next two */
    float *depths;
    uint16_t *normals;
};

/* Reads the G-buffer back. */
void host_picture_read(const struct technique_run *run, struct host_picture *picture);
void host_picture_finish(struct host_picture *picture);

/* Four halves per pixel, of all faces of the light, into vis. */
void host_picture_write(const struct technique_run *run, const uint16_t *halves);
/* Likewise, of the one face, what pen_trace_visibility gives; `horizon`: as the mean over the part of the light above
 * each receiver's horizon. */
void host_picture_settle(const struct technique_run *run, const struct host_picture *picture,
    bool horizon, const float *visibility);
