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

/* Appends the visible runs of one instance to commands[*count] (neighbouring meshlets are merged);
 * `commands` must have room for the instance's meshlet count. `cull_back`: meshlets that face away
 * are dropped. Returns the triangles appended. */
uint64_t cull_instance(const struct cull_view *view, const struct psc_scene *blob,
    uint32_t instance, bool cull_back, struct cull_command *commands, uint32_t *count);
