/* A finished picture in memory. */
#pragma once
#include "protocol/request.h"
#include <stdbool.h>

enum pen_pixel { PEN_PIXEL_RGBA8, PEN_PIXEL_RGBA16F, PEN_PIXEL_RGBA32F };

struct pen_plane {
    char name[16];     /* layer name */
    uint32_t pixel;    /* enum pen_pixel */
    uint32_t channels; /* meaningful ones of the four: 1, 3 or 4 */
    void *data;        /* width * height pixels, tight, top row first */
};

/* Finished pixels. PEN_PIXEL_RGBA8: already tone-mapped and display-encoded. Owned by the caller,
 * who may hand it to another thread, and ends it with pen_frame_finish. */
struct pen_frame {
    uint32_t width, height;
    uint32_t plane_count;
    struct pen_plane planes[PEN_LAYERS];
};
void pen_frame_finish(struct pen_frame *frame);

/* Somebody who watches a render: what of it is there after some of its samples is a picture too. */
struct pen_result;
struct pen_viewer {
    /* Another picture would be taken now. Asked between pieces of work. */
    bool (*wants)(void *context);
    /* The picture so far, with its record. The planes are the viewer's from now on. */
    void (*show)(void *context, const struct pen_frame *frame, const struct pen_result *result);
    void *context;
    double share; /* of the render's time may go into pictures after the first */
};
