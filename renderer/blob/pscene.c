#include "renderer/blob/pscene.h"
#include "renderer/blob/check.h"
#include <sys/mman.h>
#include <sys/stat.h>

/* The file format is these structs: a change of layout needs a new PSC_VERSION. */
_Static_assert(sizeof(struct psc_header) == 144 + 16 * PSC_SECTIONS, "psc_header has padding");
_Static_assert(sizeof(struct psc_attributes) == 36, "psc_attributes has padding");
_Static_assert(sizeof(struct psc_meshlet) == 40, "psc_meshlet has padding");
_Static_assert(sizeof(struct psc_primitive) == 68, "psc_primitive has padding");
_Static_assert(sizeof(struct psc_instance) == 56, "psc_instance has padding");
_Static_assert(sizeof(struct psc_texture) == 16, "psc_texture has padding");
_Static_assert(sizeof(struct psc_image) == 24, "psc_image has padding");
_Static_assert(sizeof(struct psc_texture_ref) == 32, "psc_texture_ref has padding");
_Static_assert(sizeof(struct psc_material) == 232, "psc_material has padding");
_Static_assert(sizeof(struct psc_camera) == 128, "psc_camera has padding");
_Static_assert(sizeof(struct psc_light) == sizeof(struct pen_light) + 64, "psc_light has padding");
_Static_assert(sizeof(struct psc_rider) == 72, "psc_rider has padding");
_Static_assert(sizeof(struct psc_joint) == 52, "psc_joint has padding");
_Static_assert(sizeof(struct psc_deform) == 40, "psc_deform has padding");
_Static_assert(sizeof(struct psc_bind) == 40, "psc_bind has padding");
_Static_assert(sizeof(struct psc_delta) == 40, "psc_delta has padding");
_Static_assert(sizeof(struct psc_animation) == 72, "psc_animation has padding");
_Static_assert(sizeof(struct psc_variant) == 68, "psc_variant has padding");
_Static_assert(sizeof(struct psc_sampler) == 20, "psc_sampler has padding");
_Static_assert(sizeof(struct psc_material_rest) == 140, "psc_material_rest has padding");
_Static_assert(sizeof(struct psc_light_rest) == 28, "psc_light_rest has padding");
_Static_assert(sizeof(struct psc_node) == 160, "psc_node has padding");
_Static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "the blob is little-endian");

static const uint32_t item_bytes[PSC_SECTIONS] = {[PSC_POSITIONS] = 12,
    [PSC_ATTRIBUTES] = sizeof(struct psc_attributes),
    [PSC_INDICES] = 4,
    [PSC_MESHLETS] = sizeof(struct psc_meshlet),
    [PSC_PRIMITIVES] = sizeof(struct psc_primitive),
    [PSC_INSTANCES] = sizeof(struct psc_instance),
    [PSC_MATERIALS] = sizeof(struct psc_material),
    [PSC_TEXTURES] = sizeof(struct psc_texture),
    [PSC_IMAGES] = sizeof(struct psc_image),
    [PSC_TEXELS] = 4,
    [PSC_LIGHTS] = sizeof(struct psc_light),
    [PSC_CAMERAS] = sizeof(struct psc_camera),
    [PSC_WARNINGS] = 1,
#define X(id, name, type) [PSC_##id] = sizeof(type),
    PSC_MOTION_SECTIONS(X)
#undef X
};

static bool is_point(const double p[3])
{
    return isfinite(p[0]) && isfinite(p[1]) && isfinite(p[2]);
}

static bool check_header(const struct psc_header *header, size_t bytes, struct pen_error *error)
{
    if (memcmp(header->magic, PSC_MAGIC, sizeof header->magic))
        return DAMAGED(error, "not a scene file.");
    if (header->version != PSC_VERSION)
        return DAMAGED(error, "version %u, expected %u.", header->version, PSC_VERSION);
    if (header->header_bytes != sizeof *header || header->reserved)
        return DAMAGED(error, "the header is malformed.");
    if (!is_point(header->origin))
        return DAMAGED(error, "the origin is not finite.");
    if (header->file_bytes != bytes)
        return DAMAGED(error, "%llu bytes long, expected %llu.", (unsigned long long)bytes,
            (unsigned long long)header->file_bytes);
    uint64_t end = sizeof *header;
    for (int i = 0; i < PSC_SECTIONS; i++) {
        const struct psc_section *s = &header->sections[i];
        if (s->offset % 64 || s->offset < end || s->offset > bytes || s->bytes > bytes - s->offset)
            return DAMAGED(error, "section %d leaves the file.", i);
        if (s->bytes % item_bytes[i])
            return DAMAGED(error, "section %d ends within an item.", i);
        uint64_t limit = i == PSC_INDICES ? PSC_MAX_INDICES : UINT32_MAX;
        if (i != PSC_TEXELS && s->bytes / item_bytes[i] > limit)
            return DAMAGED(error, "section %d has too many items.", i);
        end = s->offset + s->bytes;
    }
    return true;
}

static bool check_texture_ref(
    const struct psc_scene *scene, const struct psc_texture_ref *ref, struct pen_error *error)
{
    if (ref->texture < -1 || (ref->texture >= 0 && (uint32_t)ref->texture >= scene->texture_count))
        return DAMAGED(error, "a material's texture is out of range.");
    if (ref->uv_set > 1 || !all_finite(ref->transform, 6))
        return DAMAGED(error, "a material's texture coordinates are out of range.");
    return true;
}

static bool check_materials(const struct psc_scene *scene, struct pen_error *error)
{
    if (!scene->material_count)
        return DAMAGED(error, "there is no material.");
    const uint32_t known = PSC_DOUBLE_SIDED | PSC_UNLIT | PSC_SPECULAR_GLOSSINESS;
    for (uint32_t i = 0; i < scene->material_count; i++) {
        const struct psc_material *m = &scene->materials[i];
        if (!all_finite(m, offsetof(struct psc_material, alpha_mode) / 4))
            return DAMAGED(error, "a material factor is not finite.");
        if (m->alpha_mode > PSC_BLEND || m->flags & ~known)
            return DAMAGED(error, "a material's alpha mode or flags are unknown.");
        const struct psc_texture_ref *refs[] = {
            &m->base, &m->surface, &m->normal, &m->occlusion, &m->emission};
        for (size_t k = 0; k < sizeof refs / sizeof *refs; k++)
            if (!check_texture_ref(scene, refs[k], error))
                return false;
    }
    return true;
}

static bool check_images(const struct psc_scene *scene, struct pen_error *error)
{
    for (uint32_t i = 0; i < scene->texture_count; i++) {
        const struct psc_texture *t = &scene->textures[i];
        if (t->image >= scene->image_count || t->wrap_s > PSC_MIRROR || t->wrap_t > PSC_MIRROR ||
            t->nearest > 15)
            return DAMAGED(error, "a texture is out of range.");
    }
    for (uint32_t i = 0; i < scene->image_count; i++) {
        const struct psc_image *image = &scene->images[i];
        if (!image->width || !image->height || image->width > PSC_MAX_SIDE ||
            image->height > PSC_MAX_SIDE || image->srgb > 1)
            return DAMAGED(error, "an image's size is out of range.");
        if (image->levels != mip_levels(image->width, image->height))
            return DAMAGED(error, "an image's mip chain is incomplete.");
        uint64_t bytes = mip_chain_bytes(image->width, image->height);
        if (image->first_byte % 4 || image->first_byte > scene->texel_bytes ||
            bytes > scene->texel_bytes - image->first_byte)
            return DAMAGED(error, "an image's texels leave their section.");
    }
    return true;
}

static bool check_views(const struct psc_scene *scene, struct pen_error *error)
{
    uint32_t patterns = 0;
    while (pen_pattern_names[patterns])
        patterns++;
    for (uint32_t i = 0; i < scene->light_count; i++) {
        const struct psc_light *l = &scene->lights[i];
        const struct pen_light *light = &l->light;
        if (light->type >= PEN_LIGHT_TYPES || light->texture > PEN_TEXTURE_PATTERN ||
            light->pattern >= patterns)
            return DAMAGED(error, "a light's kind is unknown.");
        size_t first = offsetof(struct pen_light, up);
        if (!is_point(light->position) || !is_point(light->target) ||
            !all_finite((const char *)light + first,
                (offsetof(struct pen_light, texture) - first) / sizeof(float)))
            return DAMAGED(error, "a light is not finite.");
        if (!memchr(l->name, 0, sizeof l->name))
            return DAMAGED(error, "a light's name does not end.");
    }
    for (uint32_t i = 0; i < scene->camera_count; i++) {
        const struct psc_camera *c = &scene->cameras[i];
        if (!is_point(c->eye) || !is_point(c->target) || !all_finite(c->up, 3) ||
            !(c->fov_y_deg > 0 && c->fov_y_deg < 180))
            return DAMAGED(error, "a camera is out of range.");
        if (!memchr(c->name, 0, sizeof c->name))
            return DAMAGED(error, "a camera's name does not end.");
    }
    if (scene->warning_bytes && scene->warnings[scene->warning_bytes - 1])
        return DAMAGED(error, "a warning does not end.");
    return true;
}

bool psc_open_memory(
    const void *data, size_t bytes, struct psc_scene *scene, struct pen_error *error)
{
    memset(scene, 0, sizeof *scene);
    const struct psc_header *header = data;
    if (bytes < sizeof *header || (uintptr_t)data % 8)
        return DAMAGED(error, "too short.");
    if (!check_header(header, bytes, error))
        return false;

    const char *base = data;
    const struct psc_section *s = header->sections;
#define AT(id) ((const void *)(base + s[id].offset))
#define COUNT(id) ((uint32_t)(s[id].bytes / item_bytes[id]))
    struct psc_scene found = {
        .header = header,
        .positions = AT(PSC_POSITIONS),
        .attributes = AT(PSC_ATTRIBUTES),
        .indices = AT(PSC_INDICES),
        .meshlets = AT(PSC_MESHLETS),
        .primitives = AT(PSC_PRIMITIVES),
        .instances = AT(PSC_INSTANCES),
        .materials = AT(PSC_MATERIALS),
        .textures = AT(PSC_TEXTURES),
        .images = AT(PSC_IMAGES),
        .texels = AT(PSC_TEXELS),
        .lights = AT(PSC_LIGHTS),
        .cameras = AT(PSC_CAMERAS),
        .warnings = AT(PSC_WARNINGS),
#define X(id, name, type) .motion.name##s = AT(PSC_##id), .motion.name##_count = COUNT(PSC_##id),
        PSC_MOTION_SECTIONS(X)
#undef X
            .vertex_count = COUNT(PSC_POSITIONS),
        .index_count = COUNT(PSC_INDICES),
        .meshlet_count = COUNT(PSC_MESHLETS),
        .primitive_count = COUNT(PSC_PRIMITIVES),
        .instance_count = COUNT(PSC_INSTANCES),
        .material_count = COUNT(PSC_MATERIALS),
        .texture_count = COUNT(PSC_TEXTURES),
        .image_count = COUNT(PSC_IMAGES),
        .light_count = COUNT(PSC_LIGHTS),
        .camera_count = COUNT(PSC_CAMERAS),
        .texel_bytes = s[PSC_TEXELS].bytes,
        .warning_bytes = s[PSC_WARNINGS].bytes,
    };
    if (COUNT(PSC_ATTRIBUTES) != found.vertex_count)
        return DAMAGED(error, "positions and attributes differ in number.");
#undef AT
#undef COUNT
    if (!check_materials(&found, error) || !check_images(&found, error) ||
        !check_views(&found, error) || !psc_check_geometry(&found, error) ||
        !psc_check_motion(&found, error))
        return false;
    *scene = found;
    return true;
}

bool psc_open(int fd, struct psc_scene *scene, struct pen_error *error)
{
    memset(scene, 0, sizeof *scene);
    struct stat status;
    if (fstat(fd, &status) || !S_ISREG(status.st_mode))
        return DAMAGED(error, "not a file.");
    if (status.st_size < (off_t)sizeof(struct psc_header))
        return DAMAGED(error, "too short.");
    size_t bytes = (size_t)status.st_size;
    void *map = mmap(NULL, bytes, PROT_READ, MAP_PRIVATE, fd, 0);
    if (map == MAP_FAILED)
        return DAMAGED(error, "it cannot be mapped.");
    if (!psc_open_memory(map, bytes, scene, error)) {
        munmap(map, bytes);
        return false;
    }
    scene->map_bytes = bytes;
    return true;
}

void psc_rest(const struct psc_scene *scene)
{
    if (scene->map_bytes)
        madvise((void *)scene->header, scene->map_bytes, MADV_DONTNEED);
}

void psc_close(struct psc_scene *scene)
{
    if (scene->map_bytes)
        munmap((void *)scene->header, scene->map_bytes);
    memset(scene, 0, sizeof *scene);
}
