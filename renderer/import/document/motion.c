#include "renderer/import/document/motion.h"
#include "protocol/memory.h"
#include "renderer/blob/motion.h"
#include "renderer/import/base/budget.h"
#include <cjson/cJSON.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const cJSON *member(const cJSON *object, const char *key)
{
    return cJSON_GetObjectItemCaseSensitive(object, key);
}

static int32_t index_of(const cJSON *object, const char *key)
{
    const cJSON *value = member(object, key);
    return value ? (int32_t)value->valuedouble : -1;
}

/* How many items the arrays `key` of all items have together. */
static uint64_t count_all(const cJSON *items, const char *key)
{
    const cJSON *item;
    uint64_t count = 0;
    cJSON_ArrayForEach(item, items) count += (uint64_t)cJSON_GetArraySize(member(item, key));
    return count;
}

static bool read_skins(struct gltf_motion *motion, const cJSON *skins, struct pen_error *error)
{
    const cJSON *skin, *joint;
    uint32_t next = 0;
    uint64_t joints = count_all(skins, "joints");
    if (joints > IMP_MAX_TOTAL_JOINTS)
        return pen_fail(error, PEN_INVALID, "/skins",
            "The glTF's skins have more than %u joints together.", IMP_MAX_TOTAL_JOINTS);
    motion->skins = pen_alloc_zero((size_t)cJSON_GetArraySize(skins), sizeof *motion->skins);
    motion->joints = pen_alloc_zero(joints, sizeof *motion->joints);
    cJSON_ArrayForEach(skin, skins)
    {
        char pointer[64];
        struct gltf_skin *to = &motion->skins[motion->skin_count];
        snprintf(pointer, sizeof pointer, "/skins/%u", motion->skin_count++);
        *to = (struct gltf_skin){index_of(skin, "inverseBindMatrices"), next, 0};
        cJSON_ArrayForEach(joint, member(skin, "joints"))
        {
            motion->joints[next++] = (uint32_t)joint->valuedouble;
            to->joint_count++;
        }
        if (!to->joint_count || to->joint_count > IMP_MAX_JOINTS)
            return pen_fail(error, PEN_INVALID, pointer,
                "glTF %s: it has %u joints; from 1 to %u are possible.", pointer, to->joint_count,
                IMP_MAX_JOINTS);
    }
    return true;
}

static bool read_samplers(struct gltf_motion *motion, const cJSON *animation, const char *pointer,
    struct pen_error *error)
{
    static const char *const names[] = {"STEP", "LINEAR", "CUBICSPLINE"};
    const cJSON *sampler;
    cJSON_ArrayForEach(sampler, member(animation, "samplers"))
    {
        const char *name = cJSON_GetStringValue(member(sampler, "interpolation"));
        uint32_t kind = PSC_LINEAR;
        if (name)
            for (kind = 0; kind < PSC_INTERPOLATIONS && strcmp(names[kind], name);)
                kind++;
        if (kind == PSC_INTERPOLATIONS)
            return pen_fail(error, PEN_INVALID, pointer,
                "glTF %s: a sampler's interpolation is unknown.", pointer);
        motion->samplers[motion->sampler_count++] = (struct gltf_animation_sampler){
            index_of(sampler, "input"), index_of(sampler, "output"), kind};
    }
    return true;
}

static bool read_channels(struct gltf_motion *motion, const struct gltf_animation *to,
    const cJSON *animation, const char *pointer, struct pen_error *error)
{
    const cJSON *channel;
    cJSON_ArrayForEach(channel, member(animation, "channels"))
    {
        const cJSON *target = member(channel, "target");
        const cJSON *extension = member(member(target, "extensions"), "KHR_animation_pointer");
        uint32_t sampler = (uint32_t)index_of(channel, "sampler");
        if (sampler >= to->sampler_count)
            return pen_fail(
                error, PEN_INVALID, pointer, "glTF %s: a channel has no sampler.", pointer);
        motion->channels[motion->channel_count++] =
            (struct gltf_channel){.sampler = to->first_sampler + sampler,
                .node = index_of(target, "node"),
                .path = member(target, "path")->valuestring,
                .pointer = cJSON_GetStringValue(member(extension, "pointer"))};
    }
    return true;
}

static bool read_animations(
    struct gltf_motion *motion, const cJSON *animations, struct pen_error *error)
{
    const cJSON *animation;
    uint64_t channels = count_all(animations, "channels");
    uint64_t samplers = count_all(animations, "samplers");
    if (cJSON_GetArraySize(animations) > (int)IMP_MAX_ANIMATIONS)
        return pen_fail(error, PEN_TOO_BIG, "/animations", "The glTF has more than %u animations.",
            IMP_MAX_ANIMATIONS);
    if (channels > IMP_MAX_CHANNELS || samplers > IMP_MAX_CHANNELS)
        return pen_fail(error, PEN_TOO_BIG, "/animations",
            "The glTF's animations have more than %u channels or samplers.", IMP_MAX_CHANNELS);
    motion->animations =
        pen_alloc_zero((size_t)cJSON_GetArraySize(animations), sizeof *motion->animations);
    motion->channels = pen_alloc_zero(channels, sizeof *motion->channels);
    motion->samplers = pen_alloc_zero(samplers, sizeof *motion->samplers);
    cJSON_ArrayForEach(animation, animations)
    {
        char pointer[64];
        const char *name = cJSON_GetStringValue(member(animation, "name"));
        struct gltf_animation *to = &motion->animations[motion->animation_count];
        snprintf(pointer, sizeof pointer, "/animations/%u", motion->animation_count++);
        to->name = name ? name : "";
        to->first_sampler = motion->sampler_count;
        to->first_channel = motion->channel_count;
        if (!read_samplers(motion, animation, pointer, error))
            return false;
        to->sampler_count = motion->sampler_count - to->first_sampler;
        if (!read_channels(motion, to, animation, pointer, error))
            return false;
        to->channel_count = motion->channel_count - to->first_channel;
    }
    return true;
}

bool gltf_motion_read(
    struct gltf_motion *motion, const struct imp_document *document, struct pen_error *error)
{
    memset(motion, 0, sizeof *motion);
    if (read_skins(motion, member(document->root, "skins"), error) &&
        read_animations(motion, member(document->root, "animations"), error))
        return true;
    gltf_motion_finish(motion);
    return false;
}

void gltf_motion_finish(struct gltf_motion *motion)
{
    free(motion->skins);
    free(motion->joints);
    free(motion->animations);
    free(motion->channels);
    free(motion->samplers);
    memset(motion, 0, sizeof *motion);
}
