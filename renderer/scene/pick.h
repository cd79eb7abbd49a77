/* Of what is drawn, single triangles: software rasterisers pay for each of them, and most for those
 * that are drawn at several places of every pixel. */
#pragma once
#include "renderer/scene/cull.h"

/* Square tiles of a picture, in some of which triangles are wanted. */
struct pick_tiles {
    uint32_t width, height;
    float across, down; /* tiles between the borders of clip space; row 0 is at y = 1 */
    mat4 world_to_clip;
    const float *farthest; /* width x height: the farthest depth (reversed) that is wanted there;
                              above 1: nothing is */
};

struct picked { /* zeroed to begin with */
    uint32_t *indices;
    size_t count, room;
    struct pick_corner *corners; /* vertices on the screen, of the instance at hand */
    size_t corner_room;
};

/* Of the commands from `first` on, which are of one instance, leaves one at most: of the triangles
 * that are wanted, appended to picked->indices. */
void pick_triangles(const struct pick_tiles *tiles, const struct psc_scene *blob,
    struct cull_command *commands, uint32_t first, uint32_t *count, struct picked *picked);
void pick_finish(struct picked *picked);
