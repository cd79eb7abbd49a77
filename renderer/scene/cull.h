/* Which meshlets a view may see: frustum and normal-cone tests on the CPU. Software rasterisers pay
 * per triangle, so what is culled here is most of the geometry cost saved. */
#pragma once
#include "renderer/blob/pscene.h"
#include <cglm/types.h>

/* Which triangles that turn their back to the eye are left out. */
enum cull_faces {
    CULL_NONE,
    CULL_SINGLE_SIDED, /* of single-sided materials */
    CULL_CLOSED,       /* of closed surfaces seen from outside: their fronts hide them all */
};

struct cull_view {
    mat4 world_to_clip; /* 0 <= z <= w is inside */
    float eye[3];       /* world; parallel: unit direction of view instead */
    bool parallel;
    enum cull_faces faces;
};

/* As DrawElementsIndirectCommand. */
struct cull_command {
    uint32_t count, instance_count, first_index, base_vertex, base_instance;
};

/* One piece of a drawing that is made in several. What it costs is counted in pixels that its triangles
 * may cover and that are drawn one over the other, and never too low. */
struct cull_piece {
    double pixels; /* of what the view shows */
    double most;   /* that it may cost; infinite: it is all */
    double work;   /* what it does cost */
    /* Where it begins, and then where the next one does: all 0 is the beginning. */
    uint32_t group, instance, meshlet, index;
    bool more;     /* there is a next one */
    bool compiles; /* the driver may have to compile for it: it says nothing of others */
};

/* What is to be drawn of a scene. */
struct cull_list {
    const struct psc_scene *blob;
    float *areas; /* of each meshlet's triangles, object space, m2; below 0: not known yet */
    struct cull_command *commands;
    uint32_t count, room;
    double weight; /* a pixel's work */
};

/* Work of a change of materials, and of a pixel that looks at textures, compared with one that only has
 * a depth. */
#define CULL_STATE_WORK (1u << 16)
#define CULL_TEXTURED_WEIGHT 8

/* Appends the visible runs of one instance, from the piece's meshlet and index on (neighbouring
 * meshlets are merged), as long as it may cost more and there is room; at the instance's end both are
 * 0 again, else there is more. `cull_back`: meshlets that face away are dropped. Returns the triangles
 * appended. */
uint64_t cull_instance(const struct cull_view *view, uint32_t instance, bool cull_back,
    struct cull_list *list, struct cull_piece *piece);
