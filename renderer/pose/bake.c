#include "renderer/pose/bake.h"
#include "protocol/memory.h"
#include "renderer/pose/internal.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

static void put(struct psc_header *file, enum psc_section_id section, const void *data)
{
    if (file->sections[section].bytes)
        memcpy((char *)file + file->sections[section].offset, data, file->sections[section].bytes);
}

/* Every section ends on the file's last bytes or on zeros before the next: an empty one may lie at
 * any multiple of 64 within the file. */
static void cut_motion(struct psc_header *file, size_t *bytes)
{
    const struct psc_section *last = &file->sections[PSC_SWAPS]; /* what moves lies behind it */
    uint64_t end = last->offset + last->bytes, at = (end + 63) / 64 * 64;
    if (at > *bytes) /* there is nothing */
        return;
    for (int i = PSC_NODES; i < PSC_SECTIONS; i++)
        file->sections[i] = (struct psc_section){at, 0};
    file->file_bytes = *bytes = at;
}

/* The builder left out what deforms, and knows its own origin alone. */
static void finish_extent(struct psc_header *file, const struct pose *pose)
{
    for (int k = 0; k < 3; k++) {
        double away = file->origin[k] - pose_scene(pose)->header->origin[k];
        file->extent_min[k] = (float)(file->extent_min[k] + away);
        file->extent_max[k] = (float)(file->extent_max[k] + away);
    }
    const struct psc_motion *m = &pose->rest->motion;
    bool *deforms = pen_alloc_zero(pose->rest->primitive_count, sizeof *deforms);
    for (uint32_t i = 0; i < m->deform_count; i++)
        deforms[m->deforms[i].primitive] = true;
    for (uint32_t i = 0; i < pose->rest->instance_count; i++)
        for (int k = 0; deforms[pose->instances[i].primitive] &&
                        !(pose->instances[i].flags & PSC_HIDDEN) && k < 3;
             k++) {
            file->extent_min[k] = fminf(file->extent_min[k], pose->instance_bounds[i][0][k]);
            file->extent_max[k] = fmaxf(file->extent_max[k], pose->instance_bounds[i][1][k]);
        }
    free(deforms);
}

bool pose_bake(void *data, size_t *bytes, struct pen_error *error)
{
    struct psc_header *file = data;
    struct psc_scene built;
    uint32_t changes;
    if (!psc_open_memory(data, *bytes, &built, error))
        return false;
    /* Where anything can be posed, it is at rest as a pose has it. */
    if (built.motion.deform_count || built.motion.animation_count || built.motion.variant_count) {
        struct pose *pose = pose_create(&built);
        bool done = pose_set(pose, -1, 0, &changes, error);
        const struct psc_scene *posed = pose_scene(pose);
        if (done) {
            if (built.motion.deform_count) {
                put(file, PSC_POSITIONS, posed->positions);
                put(file, PSC_ATTRIBUTES, posed->attributes);
                put(file, PSC_MESHLETS, posed->meshlets);
                put(file, PSC_PRIMITIVES, posed->primitives);
            }
            put(file, PSC_INSTANCES, pose_instances(pose));
            memcpy(file->bounds_min, posed->header->bounds_min, sizeof file->bounds_min);
            memcpy(file->bounds_max, posed->header->bounds_max, sizeof file->bounds_max);
            file->triangles = posed->header->triangles;
            finish_extent(file, pose);
            memcpy(file->origin, posed->header->origin, sizeof file->origin);
        } else if (error && !strcmp(error->pointer, "/time_s")) {
            *error = (struct pen_error){0};
            pen_fail(error, PEN_INVALID, "",
                "At rest, skins or morph targets move something beyond 1e12 m.");
        }
        pose_destroy(pose);
        if (!done)
            return false;
    }
    if (!built.motion.animation_count)
        cut_motion(file, bytes);
    return psc_open_memory(data, *bytes, &built, error);
}
