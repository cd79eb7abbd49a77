/* Skins, morph targets and animations on their way into the blob. Until imp_motion_close, nodes are
 * called by their numbers in the file. */
#pragma once
#include "renderer/import/convert/context.h"
#include "renderer/import/document/motion.h"

struct imp_motion {
    struct gltf_motion source;
    int32_t *parents;     /* of nodes; -1: none */
    uint32_t *order;      /* of nodes: parents first */
    bool *moves;          /* an animation places it, or a node above it */
    bool *unveils;        /* an animation says whether it, or a node above it, is hidden */
    bool *weighted;       /* an animation sets its morph weights */
    double (*worlds)[12]; /* of nodes, at rest; NULL without skins */

    struct imp_slots {
        uint32_t first, count; /* PSC_WEIGHTS; count 0: none yet */
    } * node_slots, *mesh_slots;
    struct imp_deformed {
        int64_t owner; /* of its weights: a node, -1 the mesh; -2: not there yet */
        uint32_t psc;
    } * deformed; /* by glTF primitive: the last of its primitives that were only morphed */

    uint32_t *skins;              /* psc number of each glTF skin, or IMP_NOT_YET */
    double (**skin_matrices)[12]; /* of their joints, at rest */
    struct psc_skin *psc_skins;
    struct psc_joint *joints;
    struct psc_deform *deforms;
    struct psc_rider *riders;
    float *weights;
    size_t psc_skin_count, joint_count, deform_count, rider_count, weight_count;
    size_t psc_skin_room, joint_room, deform_room, rider_room, weight_room;
    uint64_t target_count, morph_values, delta_count, vertex_count,
        key_count; /* against budget.h */

    struct imp_use { /* which glTF light or camera one of the blob's is */
        uint32_t from, psc, node;
    } * lights, *cameras;
    size_t light_count, camera_count, light_room, camera_room;
};

/* A node's own transform, row-major 3x4. */
void imp_local_matrix(const struct gltf_node *node, double out[12]);

/* After the forest was checked and before any node is visited. `roots`: the nodes that the scene is
 * drawn from, with whatever is above them left out. Errors: PEN_INVALID, PEN_TOO_BIG. */
bool imp_motion_open(struct imp_context *context, const uint32_t *roots, uint32_t root_count,
    struct pen_error *error);
void imp_motion_free(struct imp_motion *motion); /* NULL is fine */

/* Notes that a node carries an item, when that node moves or it depends on the pose where the item's
 * vertices are. */
void imp_motion_ride_instance(struct imp_motion *motion, uint32_t node, uint32_t item,
    const double local[12], bool deforms, bool skinned); /* row-major; NULL: the node's own place */
void imp_motion_ride(struct imp_motion *motion, uint32_t node, enum psc_rider_kind kind,
    uint32_t item, const float size[2]);
void imp_motion_use_light(struct imp_motion *motion, struct imp_use item);
void imp_motion_use_camera(struct imp_motion *motion, struct imp_use item);
