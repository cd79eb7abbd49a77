#include "renderer/picture.h"
#include <stdlib.h>
#include <string.h>

void pen_frame_finish(struct pen_frame *frame)
{
    for (uint32_t i = 0; i < frame->plane_count; i++)
        free(frame->planes[i].data);
    memset(frame, 0, sizeof *frame);
}
