#include "renderer/blob/builder.h"
#include "protocol/memory.h"
#include "renderer/blob/affine.h"
#include "renderer/blob/check.h"
#include "renderer/blob/geometry.h"
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

#define BOUND_BUDGET (64u << 20) /* vertices transformed for tight world bounds */

struct array {
    char *data;
    size_t bytes, capacity;
};

/* What is known of a primitive beside what the blob holds. */
struct made {
    float (*points)[3]; /* that it was made for; none: its own positions */
    uint32_t point_count;
    bool deforms;
};

/* Where an instance is in the file's world. */
struct place {
    double world[12];
    double min[3], max[3]; /* deforms: its bounds, which the matrix does not tell */
    bool deforms;
};

struct psc_builder {
    struct array sections[PSC_SECTIONS];
    struct array places; /* struct place of every instance */
    struct made *made;   /* by primitive */
    size_t made_capacity;
    uint32_t primitive_count;
    uint32_t lost_instances; /* of primitives that do not exist, or with non-finite transforms */
};

static void *append(struct array *array, const void *data, size_t bytes)
{
    array->data = pen_grow(array->data, &array->capacity, array->bytes + bytes, 1);
    char *at = array->data + array->bytes;
    if (data)
        memcpy(at, data, bytes);
    array->bytes += bytes;
    return at;
}

static uint32_t append_item(struct array *array, const void *item, size_t bytes)
{
    append(array, item, bytes);
    return (uint32_t)(array->bytes / bytes - 1);
}

struct psc_builder *psc_builder_create(void)
{
    struct psc_builder *builder = pen_alloc(1, sizeof *builder);
    memset(builder, 0, sizeof *builder);
    return builder;
}

void psc_builder_destroy(struct psc_builder *builder)
{
    if (!builder)
        return;
    for (int i = 0; i < PSC_SECTIONS; i++)
        free(builder->sections[i].data);
    free(builder->places.data);
    for (uint32_t i = 0; i < builder->primitive_count; i++)
        free(builder->made[i].points);
    free(builder->made);
    free(builder);
}

uint32_t psc_builder_add_material(struct psc_builder *builder, const struct psc_material *material)
{
    return append_item(&builder->sections[PSC_MATERIALS], material, sizeof *material);
}

uint32_t psc_builder_add_texture(struct psc_builder *builder, const struct psc_texture *texture)
{
    return append_item(&builder->sections[PSC_TEXTURES], texture, sizeof *texture);
}

uint32_t psc_builder_add_image(
    struct psc_builder *builder, uint32_t width, uint32_t height, bool srgb, const uint8_t *rgba)
{
    struct array *texels = &builder->sections[PSC_TEXELS];
    struct psc_image image = {.width = width,
        .height = height,
        .levels = mip_levels(width, height),
        .srgb = srgb,
        .first_byte = texels->bytes};
    uint8_t *chain = append(texels, NULL, mip_chain_bytes(width, height));
    memcpy(chain, rgba, 4 * (size_t)width * height);
    psc_make_mips(chain, width, height, srgb);
    return append_item(&builder->sections[PSC_IMAGES], &image, sizeof image);
}

uint32_t psc_builder_add_light(struct psc_builder *builder, const struct psc_light *light)
{
    struct psc_light copy = *light;
    copy.name[sizeof copy.name - 1] = 0;
    return append_item(&builder->sections[PSC_LIGHTS], &copy, sizeof copy);
}

uint32_t psc_builder_add_camera(struct psc_builder *builder, const struct psc_camera *camera)
{
    struct psc_camera copy = *camera;
    copy.name[sizeof copy.name - 1] = 0;
    return append_item(&builder->sections[PSC_CAMERAS], &copy, sizeof copy);
}

void psc_builder_add_warning(struct psc_builder *builder, const char *format, ...)
{
    char text[512];
    va_list args;
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    append(&builder->sections[PSC_WARNINGS], text, strlen(text) + 1);
}

uint32_t psc_builder_add_motion(
    struct psc_builder *builder, enum psc_section_id section, const void *items, uint32_t count)
{
    static const uint32_t item_bytes[] = {
#define X(id, name, type) [PSC_##id - PSC_VARIANTS] = sizeof(type),
        PSC_MOTION_SECTIONS(X)
#undef X
    };
    struct array *array = &builder->sections[section];
    uint32_t bytes = item_bytes[section - PSC_VARIANTS];
    uint32_t first = (uint32_t)(array->bytes / bytes);
    append(array, items, (size_t)count * bytes);
    return first;
}

static int16_t snorm16(float x)
{
    return (int16_t)lrintf(fminf(fmaxf(x, -1), 1) * 32767);
}

static void append_vertices(struct psc_builder *builder, const struct geometry *g)
{
    append(&builder->sections[PSC_POSITIONS], g->positions, g->vertex_count * sizeof *g->positions);
    struct psc_attributes *attributes =
        append(&builder->sections[PSC_ATTRIBUTES], NULL, g->vertex_count * sizeof *attributes);
    for (uint32_t i = 0; i < g->vertex_count; i++) {
        struct psc_attributes *a = &attributes[i];
        memset(a, 0, sizeof *a);
        for (int k = 0; k < 3; k++)
            a->normal[k] = snorm16(g->normals[i][k]);
        for (int k = 0; g->tangents && k < 4; k++)
            a->tangent[k] = snorm16(g->tangents[i][k]);
        memcpy(a->uv, g->uv[i], sizeof a->uv);
        memcpy(a->color, g->colors[i], sizeof a->color);
    }
}

static uint32_t append_meshlets(struct psc_builder *builder, const struct geometry *g,
    const struct psc_mesh *mesh, uint32_t first_index)
{
    uint32_t count = 0;
    for (uint32_t at = 0; at < g->index_count; count++) {
        uint32_t left = (g->index_count - at) / 3;
        uint32_t triangles = left < PSC_MESHLET_TRIANGLES ? left : PSC_MESHLET_TRIANGLES;
        if (mesh->meshlet_triangles)
            triangles = mesh->meshlet_triangles[count];
        struct psc_meshlet m = {.first_index = first_index + at, .index_count = 3 * triangles};
        psc_meshlet_bound(&m, (const float(*)[3])g->positions, g->indices + at);
        append(&builder->sections[PSC_MESHLETS], &m, sizeof m);
        at += m.index_count;
    }
    return count;
}

static void move_near(struct psc_primitive *p, struct geometry *g, const float base[3])
{
    double min[3], max[3], origin[3];
    for (int k = 0; k < 3; k++) {
        min[k] = max[k] = g->vertex_count ? g->positions[0][k] : 0;
        for (uint32_t i = 1; i < g->vertex_count; i++) {
            min[k] = fmin(min[k], g->positions[i][k]);
            max[k] = fmax(max[k], g->positions[i][k]);
        }
    }
    psc_choose_origin(min, max, origin);
    for (int k = 0; k < 3; k++) {
        p->offset[k] = (float)origin[k];
        for (uint32_t i = 0; p->offset[k] != 0 && i < g->vertex_count; i++)
            g->positions[i][k] -= p->offset[k];
        p->offset[k] += base[k];
    }
}

static void remember(struct psc_builder *builder, uint32_t primitive, const struct psc_mesh *mesh,
    const float offset[3])
{
    builder->made = pen_grow(
        builder->made, &builder->made_capacity, (size_t)primitive + 1, sizeof *builder->made);
    struct made *made = &builder->made[primitive];
    builder->primitive_count = primitive + 1;
    *made = (struct made){.point_count = mesh->points ? mesh->point_count : 0};
    if (made->point_count) {
        made->points = pen_alloc_zero(made->point_count, sizeof *made->points);
        for (uint32_t i = 0; i < made->point_count; i++)
            for (int k = 0; k < 3; k++)
                made->points[i][k] = mesh->points[i][k] - (offset[k] - mesh->base[k]);
    }
}

/* `near`: vertices far from their origin are kept relative to an offset. */
static bool add_geometry(struct psc_builder *builder, const struct psc_mesh *mesh,
    struct geometry *geometry, bool near, uint32_t *primitive, struct pen_error *error)
{
    struct geometry g = *geometry;
    struct array *s = builder->sections;
    size_t first_vertex = s[PSC_POSITIONS].bytes / 12, first_index = s[PSC_INDICES].bytes / 4;
    if (first_vertex + g.vertex_count > UINT32_MAX || first_index + g.index_count > PSC_MAX_INDICES)
        return pen_fail(error, PEN_INVALID, "", "The scene has more than 2^31 indices.");
    struct psc_primitive p = {.first_index = (uint32_t)first_index,
        .index_count = g.index_count,
        .first_vertex = (uint32_t)first_vertex,
        .vertex_count = g.vertex_count,
        .first_meshlet = (uint32_t)(s[PSC_MESHLETS].bytes / sizeof(struct psc_meshlet)),
        .material = mesh->material};
    if (near)
        move_near(&p, &g, mesh->base);
    for (uint32_t i = 0; i < g.vertex_count; i++)
        for (int k = 0; k < 3; k++) {
            float x = g.positions[i][k];
            p.bounds_min[k] = !i || x < p.bounds_min[k] ? x : p.bounds_min[k];
            p.bounds_max[k] = !i || x > p.bounds_max[k] ? x : p.bounds_max[k];
        }
    p.flags = mesh->closed ? PSC_WATERTIGHT | PSC_OUTWARD
                           : psc_surface_flags((const float(*)[3])g.positions, g.vertex_count,
                                 g.indices, g.index_count);

    append_vertices(builder, &g);
    p.meshlet_count = append_meshlets(builder, &g, mesh, p.first_index);
    uint32_t *indices = append(&s[PSC_INDICES], NULL, g.index_count * sizeof *indices);
    for (uint32_t i = 0; i < g.index_count; i++)
        indices[i] = p.first_vertex + g.indices[i];
    *primitive = append_item(&s[PSC_PRIMITIVES], &p, sizeof p);
    remember(builder, *primitive, mesh, p.offset);
    return true;
}

bool psc_builder_add_mesh(struct psc_builder *builder, const struct psc_mesh *mesh,
    uint32_t *primitive, struct pen_error *error)
{
    struct geometry g;
    if (!psc_geometry_create(&g, mesh, error))
        return false;
    bool done = add_geometry(builder, mesh, &g, true, primitive, error);
    psc_geometry_finish(&g);
    return done;
}

static void append_bind(struct psc_builder *builder, const struct geometry *g)
{
    struct psc_bind *binds =
        append(&builder->sections[PSC_BIND], NULL, g->vertex_count * sizeof *binds);
    for (uint32_t i = 0; i < g->vertex_count; i++) {
        memset(&binds[i], 0, sizeof binds[i]);
        memcpy(binds[i].position, g->positions[i], sizeof binds[i].position);
        memcpy(binds[i].normal, g->normals[i], sizeof binds[i].normal);
        if (g->tangents)
            memcpy(binds[i].tangent, g->tangents[i], sizeof binds[i].tangent);
    }
}

static void append_influences(
    struct psc_builder *builder, const struct geometry *g, const struct psc_mesh_deform *how)
{
    size_t bytes = how->influence_count * sizeof *how->influences;
    for (uint32_t i = 0; i < g->vertex_count && bytes; i++)
        append(&builder->sections[PSC_INFLUENCES],
            how->influences + (size_t)g->sources[i] * how->influence_count, bytes);
}

/* `slots`: room for one number per vertex of the caller's, all 0. */
static void append_target(struct psc_builder *builder, const struct geometry *g,
    const struct psc_delta *deltas, uint32_t count, uint32_t *slots)
{
    struct array *out = &builder->sections[PSC_DELTAS];
    struct psc_target target = {.first_delta = (uint32_t)(out->bytes / sizeof *deltas)};
    for (uint32_t i = 0; i < count; i++)
        slots[deltas[i].vertex] = i + 1;
    for (uint32_t i = 0; i < g->vertex_count; i++) {
        uint32_t slot = slots[g->sources[i]];
        if (!slot)
            continue;
        struct psc_delta *delta = append(out, &deltas[slot - 1], sizeof *deltas);
        delta->vertex = i;
        target.delta_count++;
    }
    for (uint32_t i = 0; i < count; i++)
        slots[deltas[i].vertex] = 0;
    append(&builder->sections[PSC_MORPH_TARGETS], &target, sizeof target);
}

bool psc_builder_add_deforming(struct psc_builder *builder, const struct psc_mesh *mesh,
    const struct psc_mesh_deform *how, struct psc_deform *deform, struct pen_error *error)
{
    struct array *s = builder->sections;
    struct geometry g;
    if (!psc_geometry_create(&g, mesh, error))
        return false;
    *deform = (struct psc_deform){.skin = -1,
        .instance = -1,
        .first_bind = (uint32_t)(s[PSC_BIND].bytes / sizeof(struct psc_bind)),
        .first_influence = (uint32_t)(s[PSC_INFLUENCES].bytes / sizeof(struct psc_influence)),
        .influences = how->influence_count,
        .first_target = (uint32_t)(s[PSC_MORPH_TARGETS].bytes / sizeof(struct psc_target)),
        .target_count = how->target_count,
        .flags = mesh->normals ? 0 : PSC_DEFORM_FLAT};
    bool near = !how->influence_count; /* joints move vertices as they are */
    bool done = add_geometry(builder, mesh, &g, near, &deform->primitive, error);
    if (done) {
        struct psc_primitive *added = (struct psc_primitive *)s[PSC_PRIMITIVES].data;
        builder->made[deform->primitive].deforms = true;
        added[deform->primitive].flags = 0; /* what holds of its surface now need not later */
        uint32_t *slots = pen_alloc(mesh->vertex_count, sizeof *slots);
        memset(slots, 0, mesh->vertex_count * sizeof *slots);
        append_bind(builder, &g);
        append_influences(builder, &g, how);
        for (uint32_t t = 0; t < how->target_count; t++)
            append_target(builder, &g, how->targets[t], how->delta_counts[t], slots);
        free(slots);
    }
    psc_geometry_finish(&g);
    return done;
}

static uint32_t add_instance(
    struct psc_builder *builder, uint32_t primitive, const struct place *place)
{
    size_t primitives = builder->sections[PSC_PRIMITIVES].bytes / sizeof(struct psc_primitive);
    struct psc_instance instance = {.primitive = primitive};
    for (int i = 0; i < 12; i++)
        instance.world[i] = (float)place->world[i];
    if (primitive >= primitives || !all_finite(instance.world, 12)) {
        builder->lost_instances++;
        return 0;
    }
    if (world_determinant(instance.world) < 0)
        instance.flags |= PSC_MIRRORED;
    append(&builder->places, place, sizeof *place);
    return append_item(&builder->sections[PSC_INSTANCES], &instance, sizeof instance);
}

uint32_t psc_builder_place_instance(
    struct psc_builder *builder, uint32_t primitive, const double world[12])
{
    struct place place = {{0}};
    memcpy(place.world, world, sizeof place.world);
    return add_instance(builder, primitive, &place);
}

uint32_t psc_builder_add_instance(
    struct psc_builder *builder, uint32_t primitive, const float world[12])
{
    double wide[12];
    for (int i = 0; i < 12; i++)
        wide[i] = world[i];
    return psc_builder_place_instance(builder, primitive, wide);
}

uint32_t psc_builder_place_deforming(struct psc_builder *builder, uint32_t primitive,
    const double world[12], const double min[3], const double max[3])
{
    struct place place = {.deforms = true};
    memcpy(place.world, world, sizeof place.world);
    memcpy(place.min, min, sizeof place.min);
    memcpy(place.max, max, sizeof place.max);
    return add_instance(builder, primitive, &place);
}

void psc_builder_hide_instance(struct psc_builder *builder, uint32_t instance)
{
    struct array *list = &builder->sections[PSC_INSTANCES];
    if (instance < list->bytes / sizeof(struct psc_instance))
        ((struct psc_instance *)list->data)[instance].flags |= PSC_HIDDEN;
}

/* Chooses the blob's origin and makes all matrices relative to it, for vertices without their
 * primitive's offset. */
static void settle_instances(struct psc_builder *builder, double origin[3])
{
    const struct psc_primitive *primitives =
        (const struct psc_primitive *)builder->sections[PSC_PRIMITIVES].data;
    struct psc_instance *instances = (struct psc_instance *)builder->sections[PSC_INSTANCES].data;
    const struct place *places = (const struct place *)builder->places.data;
    size_t count = builder->places.bytes / sizeof *places;
    double min[3] = {INFINITY, INFINITY, INFINITY}, max[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (size_t i = 0; i < count; i++) {
        const struct psc_primitive *p = &primitives[instances[i].primitive];
        for (int k = 0; places[i].deforms && k < 3; k++) {
            min[k] = fmin(min[k], places[i].min[k]);
            max[k] = fmax(max[k], places[i].max[k]);
        }
        for (int c = 0; !places[i].deforms && p->index_count && c < 8; c++) {
            double corner[3], at[3];
            for (int k = 0; k < 3; k++)
                corner[k] = (double)(c >> k & 1 ? p->bounds_max[k] : p->bounds_min[k]) +
                            (double)p->offset[k];
            psc_affine_point(places[i].world, corner, at);
            for (int k = 0; k < 3; k++)
                min[k] = fmin(min[k], at[k]), max[k] = fmax(max[k], at[k]);
        }
    }
    memset(origin, 0, 3 * sizeof *origin);
    if (min[0] <= max[0])
        psc_choose_origin(min, max, origin);
    for (size_t i = 0; i < count; i++) {
        const float *offset = primitives[instances[i].primitive].offset;
        double at[3];
        psc_affine_point(places[i].world, (double[3]){offset[0], offset[1], offset[2]}, at);
        for (int k = 0; k < 3; k++)
            instances[i].world[4 * k + 3] = (float)(at[k] - origin[k]);
    }
}

struct psc_material psc_material_default(void)
{
    const struct psc_texture_ref none = {.texture = -1, .transform = {1, 0, 0, 0, 1, 0}};
    return (struct psc_material){.base_color = {1, 1, 1, 1},
        .roughness = 1,
        .specular = {1, 1, 1},
        .glossiness = 1,
        .normal_scale = 1,
        .occlusion_strength = 1,
        .alpha_cutoff = 0.5f,
        .base = none,
        .surface = none,
        .normal = none,
        .occlusion = none,
        .emission = none};
}

static void merge(float min[3], float max[3], const float box[2][3])
{
    for (int k = 0; k < 3; k++) {
        min[k] = fminf(min[k], box[0][k]);
        max[k] = fmaxf(max[k], box[1][k]);
    }
}

static void world_bounds(const struct psc_builder *builder, struct psc_header *header)
{
    const struct array *s = builder->sections;
    const struct psc_scene scene = {.positions = (const float(*)[3])s[PSC_POSITIONS].data,
        .primitives = (const struct psc_primitive *)s[PSC_PRIMITIVES].data,
        .instances = (const struct psc_instance *)s[PSC_INSTANCES].data};
    uint64_t budget = BOUND_BUDGET;
    psc_bounds_clear(header->bounds_min, header->bounds_max);
    psc_bounds_clear(header->extent_min, header->extent_max);
    for (size_t i = 0; i < s[PSC_INSTANCES].bytes / sizeof *scene.instances; i++) {
        const struct psc_primitive *p = &scene.primitives[scene.instances[i].primitive];
        if (!p->index_count || scene.instances[i].flags & PSC_HIDDEN)
            continue;
        bool tight = p->vertex_count <= budget;
        budget -= tight ? p->vertex_count : 0;
        header->triangles += p->index_count / 3;
        const struct made *made = &builder->made[scene.instances[i].primitive];
        float box[2][3];
        psc_bounds_clear(box[0], box[1]);
        psc_bounds_grow(&scene, (uint32_t)i, tight, box[0], box[1]);
        merge(header->bounds_min, header->bounds_max, (const float(*)[3])box);
        if (made->deforms)
            continue; /* as it stands, that is not the rest pose */
        if (made->point_count && tight) {
            psc_bounds_clear(box[0], box[1]);
            psc_bounds_grow_points(scene.instances[i].world, (const float(*)[3])made->points,
                made->point_count, box[0], box[1]);
        }
        merge(header->extent_min, header->extent_max, (const float(*)[3])box);
    }
}

bool psc_builder_finish(struct psc_builder *builder, const uint8_t source[PEN_ID_BYTES],
    void **data, size_t *bytes, struct pen_error *error)
{
    *data = NULL;
    *bytes = 0;
    if (!builder->sections[PSC_MATERIALS].bytes) {
        struct psc_material material = psc_material_default();
        psc_builder_add_material(builder, &material);
    }
    if (builder->lost_instances)
        return pen_fail(error, PEN_INVALID, "", "%u instances have a transform that is not finite.",
            builder->lost_instances);
    struct psc_header header = {
        .magic = PSC_MAGIC, .version = PSC_VERSION, .header_bytes = sizeof header};
    memcpy(header.source, source, sizeof header.source);
    settle_instances(builder, header.origin);
    world_bounds(builder, &header);
    if (!all_finite(header.bounds_min, 12)) /* and the extent behind them */
        return pen_fail(error, PEN_INVALID, "", "The scene's bounds are not finite.");

    uint64_t end = sizeof header;
    for (int i = 0; i < PSC_SECTIONS; i++) {
        header.sections[i].offset = (end + 63) / 64 * 64;
        header.sections[i].bytes = builder->sections[i].bytes;
        end = header.sections[i].offset + header.sections[i].bytes;
    }
    header.file_bytes = end;
    char *file = pen_alloc(end, 1);
    memset(file, 0, header.sections[0].offset);
    memcpy(file, &header, sizeof header);
    for (int i = 0; i < PSC_SECTIONS; i++) {
        size_t at = header.sections[i].offset, size = header.sections[i].bytes;
        size_t next = i + 1 < PSC_SECTIONS ? header.sections[i + 1].offset : end;
        if (size)
            memcpy(file + at, builder->sections[i].data, size);
        memset(file + at + size, 0, next - at - size);
    }
    /* What we write is what we read: a builder fed with out-of-range numbers fails here, once. */
    struct psc_scene scene;
    if (!psc_open_memory(file, end, &scene, error)) {
        free(file);
        return false;
    }
    *data = file;
    *bytes = end;
    return true;
}
