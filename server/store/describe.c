#include "server/store/describe.h"
#include "protocol/number.h"
#include "protocol/json_result.h"
#include "protocol/memory.h"
#include "renderer/blob/pscene.h"
#include "server/base/file.h"
#include <cjson/cJSON.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define MAX_META (4u << 20)

/* Geometry and textures go to the GPU nearly as they lie in the blob. */
static uint64_t gpu_bytes(const struct psc_header *header)
{
    static const enum psc_section_id resident[] = {
        PSC_POSITIONS, PSC_ATTRIBUTES, PSC_INDICES, PSC_TEXELS};
    uint64_t bytes = 0;
    for (size_t i = 0; i < sizeof resident / sizeof *resident; i++)
        bytes += header->sections[resident[i]].bytes;
    return bytes;
}

static char *describe_scene(const struct psc_scene *scene, const uint8_t id[PEN_ID_BYTES],
    uint64_t source_bytes, int64_t stored_unix_s)
{
    struct pen_scene_info info = {
        .source_bytes = source_bytes,
        .blob_bytes = scene->header->file_bytes,
        .gpu_bytes = gpu_bytes(scene->header),
        .stored_unix_s = stored_unix_s,
        .vertices = scene->vertex_count,
        .primitives = scene->primitive_count,
        .instances = scene->instance_count,
        .materials = scene->material_count,
        .textures = scene->texture_count,
        .images = scene->image_count,
        .triangles = scene->header->triangles,
        .camera_count = scene->camera_count,
        .light_count = scene->light_count,
        .animation_count = scene->motion.animation_count,
        .variant_count = scene->motion.variant_count,
        .warnings = scene->warnings,
        .warning_bytes = scene->warning_bytes,
    };
    memcpy(info.id, id, PEN_ID_BYTES);
    for (int k = 0; k < 3; k++) {
        info.bounds_min[k] = scene->header->origin[k] + pen_widen(scene->header->extent_min[k]);
        info.bounds_max[k] = scene->header->origin[k] + pen_widen(scene->header->extent_max[k]);
    }
    struct pen_scene_camera *cameras = pen_alloc_zero(scene->camera_count + 1, sizeof *cameras);
    struct pen_scene_light *lights = pen_alloc_zero(scene->light_count + 1, sizeof *lights);
    for (uint32_t i = 0; i < scene->camera_count; i++) {
        const struct psc_camera *from = &scene->cameras[i];
        memcpy(cameras[i].eye, from->eye, sizeof from->eye);
        memcpy(cameras[i].target, from->target, sizeof from->target);
        memcpy(cameras[i].up, from->up, sizeof from->up);
        cameras[i].fov_y_deg = from->fov_y_deg;
        snprintf(cameras[i].name, sizeof cameras[i].name, "%.*s",
            (int)strnlen(from->name, sizeof from->name), from->name);
    }
    for (uint32_t i = 0; i < scene->light_count; i++) {
        const struct psc_light *from = &scene->lights[i];
        lights[i].light = from->light;
        snprintf(lights[i].name, sizeof lights[i].name, "%.*s",
            (int)strnlen(from->name, sizeof from->name), from->name);
    }
    struct pen_scene_animation *animations =
        pen_alloc_zero(info.animation_count, sizeof *animations);
    for (uint32_t i = 0; i < info.animation_count; i++) {
        const struct psc_animation *from = &scene->motion.animations[i];
        animations[i].duration_s = from->duration_s;
        snprintf(animations[i].name, sizeof animations[i].name, "%s", from->name);
    }
    struct pen_scene_variant *variants = pen_alloc_zero(info.variant_count, sizeof *variants);
    for (uint32_t i = 0; i < info.variant_count; i++)
        snprintf(variants[i].name, sizeof variants[i].name, "%s", scene->motion.variants[i].name);
    info.animations = animations;
    info.variants = variants;
    info.cameras = cameras;
    info.lights = lights;
    char *text = pen_scene_json(&info);
    free(animations);
    free(variants);
    free(cameras);
    free(lights);
    return text;
}

char *describe_blob(enum store_kind kind, const uint8_t id[PEN_ID_BYTES], int blob_fd,
    uint64_t source_bytes, int64_t stored_unix_s, struct pen_error *error)
{
    struct psc_scene scene;
    char *text = NULL;
    if (!psc_open(blob_fd, &scene, error))
        return NULL;
    if (memcmp(scene.header->source, id, PEN_ID_BYTES)) {
        pen_fail(error, PEN_INTERNAL, "", "The importer mixed up two uploads.");
    } else if (kind == STORE_SCENES) {
        text = describe_scene(&scene, id, source_bytes, stored_unix_s);
    } else if (scene.image_count != 1) {
        pen_fail(error, PEN_INVALID, "", "The upload holds no image.");
    } else {
        struct pen_image_info info = {.source_bytes = source_bytes,
            .blob_bytes = scene.header->file_bytes,
            .stored_unix_s = stored_unix_s,
            .width = scene.images[0].width,
            .height = scene.images[0].height};
        memcpy(info.id, id, PEN_ID_BYTES);
        text = pen_image_json(&info);
    }
    psc_close(&scene);
    return text;
}

static cJSON *read_meta(struct scene_store *store, enum store_kind kind,
    const uint8_t id[PEN_ID_BYTES], struct pen_error *error)
{
    size_t bytes;
    int fd = scene_store_open_meta(store, kind, id, error);
    char *text = fd >= 0 ? file_read(fd, MAX_META, &bytes) : NULL;
    cJSON *root = text ? cJSON_ParseWithLength(text, bytes) : NULL;
    if (fd >= 0)
        close(fd);
    free(text);
    if (cJSON_IsObject(root))
        return root;
    cJSON_Delete(root);
    pen_fail(error, PEN_UNAVAILABLE, "", "The store could not be read.");
    return NULL;
}

/* From the blob, if that is as it was. */
static bool mend_meta(struct scene_store *store, enum store_kind kind,
    const uint8_t id[PEN_ID_BYTES], struct pen_error *error)
{
    struct store_entry entry;
    int blob = scene_store_open_blob(store, kind, id, error);
    if (blob < 0)
        return false;
    char *text = scene_store_find(store, kind, id, &entry)
                     ? describe_blob(kind, id, blob, entry.source_bytes, entry.stored_unix_s, error)
                     : NULL;
    bool ok = text && scene_store_mend_meta(store, kind, id, text);
    free(text);
    close(blob);
    return ok || pen_fail(error, PEN_UNAVAILABLE, "", "The store could not be written.");
}

char *describe_stored(struct scene_store *store, enum store_kind kind,
    const uint8_t id[PEN_ID_BYTES], const struct store_now *now, struct pen_error *error)
{
    struct pen_error damage = {0};
    cJSON *root = read_meta(store, kind, id, &damage);
    if (!root && damage.code == PEN_UNAVAILABLE && mend_meta(store, kind, id, error))
        root = read_meta(store, kind, id, error);
    if (!root) {
        pen_fail(error, damage.code, "", "%s", damage.message);
        return NULL;
    }
    if (kind == STORE_SCENES)
        cJSON_ReplaceItemInObjectCaseSensitive(root, "resident", cJSON_CreateBool(now->resident));
    cJSON *label = kind == STORE_SCENES && now->label ? cJSON_Parse(now->label) : NULL;
    while (label && label->child) {
        cJSON *member = cJSON_DetachItemViaPointer(label, label->child);
        char *key = strdup(member->string);
        cJSON_DeleteItemFromObjectCaseSensitive(root, key);
        cJSON_AddItemToObject(root, key, member);
        free(key);
    }
    cJSON_Delete(label);
    char *text = cJSON_PrintUnformatted(root);
    cJSON_Delete(root);
    if (!text)
        abort();
    return text;
}
