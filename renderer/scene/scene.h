/* A scene in GPU memory, and the drawing of it. */
#pragma once
#include "renderer/blob/pscene.h"
#include "renderer/scene/cull.h"
#include "renderer/scene/stage.h"
#include "renderer/gl/program.h"
#include "renderer/gl/states.h"
#include "renderer/gl/texture.h"

/* struct material_record, texture units of the geometry passes, locations of attributes */
#define SHARED_ROWS "renderer/shaders/geometry/material.def"
#include "renderer/shared/rows_c.h"
#define SHARED_ROWS "renderer/shaders/geometry/attributes.def"
#include "renderer/shared/rows_c.h"

/* Draws that share state. What differs per draw (matrix, material) rides on instance attributes. */
struct scene_group {
    uint32_t first, count; /* of scene->order */
    uint32_t material;     /* first that is bound */
    bool textured;         /* with its textures; it is the only one */
    uint32_t state;        /* of scene->states */
    bool double_sided, mirrored;
    bool closed; /* its surfaces are closed, face outwards and have no holes */
    bool alpha;  /* MASK or BLEND: fragments may be discarded */
    bool blend;
};

/* What a floor above keeps with a scene until that leaves the GPU: a member of a struct of its own,
 * which `destroy` frees. */
struct scene_attachment {
    struct scene_attachment *next;
    void (*destroy)(
        struct scene_attachment *attachment); /* one of each scene: it is the key, too */
    uint64_t bytes;                           /* of GPU memory; counts as the scene's */
};

/* What poses a scene; equal ones are equal bit by bit. */
struct scene_pose {
    int32_t animation; /* -1: the rest pose, at time 0 */
    float time_s;      /* within the animation */
    int32_t variant;   /* -1: as the file is */
};

struct scene {
    uint8_t id[PEN_ID_BYTES];
    struct psc_scene file; /* as mapped: the rest pose */
    struct psc_scene blob; /* as posed: culling and tracing read it */
    struct pose *poses;    /* NULL: never posed */
    struct scene_pose pose;
    GLuint positions, attributes, indices, instances, materials, commands;
    GLuint depth_array, full_array; /* vertex arrays: positions only; everything */
    struct gl_texture *images;
    GLuint *samplers; /* one per blob texture */
    uint32_t *order;  /* instances sorted by state */
    uint32_t *
        nearest; /* the same, each group's by their distance from an eye, where it was last wanted */
    float nearest_eye[3];
    bool nearest_parallel, nearest_known;
    struct scene_group *groups;
    uint32_t group_count;
    struct gl_states states;
    struct cull_command *command_room;
    uint32_t command_count;         /* of one piece of a drawing at most */
    float *meshlet_areas;           /* see cull_list */
    float (*instance_bounds)[2][3]; /* world */
    struct scene_stage rest_stage, moving_stage;
    int32_t moving_animation;        /* that moving_stage is of; -1: none yet */
    struct scene_stage moved_stage;  /* one of them, for a pose with an origin of its own */
    const struct scene_stage *stage; /* one of these */
    bool has_emission, has_unlit;
    bool has_blend;
    bool may_blend; /* in some variant */
    bool has_gloss; /* some roughness is below 0.5 */
    uint64_t bytes;
    uint64_t last_use;
    bool rests; /* what is mapped of its file takes no memory */
    struct scene_attachment *attachments;
    uint32_t moved;  /* counts the poses that put vertices or instances elsewhere */
    uint32_t remade; /* counts those with other instances, or other alpha */
};

/* Uploads the blob behind `fd`. Errors as psc_open; PEN_INTERNAL out of GPU memory. */
struct scene *scene_create(const uint8_t id[PEN_ID_BYTES], int fd, struct pen_error *error);
void scene_destroy(struct scene *scene);
/* Its file is read no more for a while. */
void scene_rest(struct scene *scene);

void scene_attach(struct scene *scene, struct scene_attachment *attachment);
/* It has become larger or smaller. */
void scene_attachment_resize(
    struct scene *scene, struct scene_attachment *attachment, uint64_t bytes);
/* The one that ends with `destroy`; NULL: none. */
struct scene_attachment *scene_attachment(
    const struct scene *scene, void (*destroy)(struct scene_attachment *attachment));
void scene_detach(struct scene *scene, struct scene_attachment *attachment); /* and destroys it */
bool scene_shed(struct scene *scene); /* detaches all; false: there is none */

/* Poses it by the request's animation ("": at rest; see pose_find), held within the animation's time,
 * and dresses it in the request's variant.
 * Buffers, bounds and all that was derived from the pose before follow. Errors: PEN_INVALID; the
 * scene is then at rest. */
bool scene_set_pose(
    struct scene *scene, const struct pen_request *request, struct pen_error *error);
/* measure.c: of the scene as posed, once it is; everything below follows from it. */
void scene_measure(struct scene *scene);
/* What a ground lies under, m: the stage's lowest point, or that of the rest pose where it is near. */
float scene_floor(const struct scene *scene);
/* The square that a ground is: centre x, height, centre z, half side. */
void scene_ground(const struct scene *scene, float ground[4]);
/* Where its light and shadow are, m. It lies a hair lower only so that a floor hides it: a look
 * through that gap would find what is under the floor, in the dark. */
float scene_ground_top(const struct scene *scene);

/* What a material has in one of the geometry passes' texture units. */
const struct psc_texture_ref *scene_slot(const struct psc_material *material, int unit);

bool scene_is_empty(const struct scene *scene);
/* Of the sphere around the stage, m; >= 1e-9. Cameras and lights are chosen to suit it: a floor
 * may be any size. */
float scene_radius(const struct scene *scene);
void scene_center(const struct scene *scene, float center[3]);
/* Points of requests and of the file, and the renderer's, which are relative to the blob's origin. */
void scene_point_in(const struct scene *scene, const double world[3], float point[3]);
void scene_point_out(const struct scene *scene, const float point[3], double world[3]);
/* From one point to another, times some power of two: short or long, its square is a float. */
void scene_direction(const double from[3], const double to[3], float direction[3]);
/* nearest.c: how near the scene as posed comes to a point, m; `most` where it is no nearer. Less than
 * that where too many triangles are near to look at each. */
float scene_nearest(const struct scene *scene, const float point[3], float most);
/* World bounds of one instance: tight, but for scenes of so many vertices that its primitive's
 * transformed box has to do. */
void scene_instance_bounds(
    const struct scene *scene, uint32_t instance, float min[3], float max[3]);

/* The two programs of a geometry pass: `opaque` without texture access, `textured` for groups that
 * need it (alpha tests, and all textured materials when `full`). */
struct scene_pass {
    GLuint opaque, textured;
    bool full; /* draws with all attributes and textures; else positions only where it can */
    bool front_is_clockwise; /* the target's y axis is flipped */
    const bool *hidden;      /* instances to leave out, or NULL */
    bool blended;            /* BLEND materials alone */
};
/* Whether the group's triangles that turn their back to the view are left out. */
bool scene_culls_back(
    const struct scene *s, const struct scene_group *group, const struct cull_view *view);
/* Draws one piece, and tells in it where the next one begins: what all pieces leave is what the whole
 * drawn at once does. Returns the triangles drawn. The caller has bound framebuffer, viewport and depth
 * state. */
uint64_t scene_draw(struct scene *scene, const struct cull_view *view,
    const struct scene_pass *pass, struct cull_piece *piece);
