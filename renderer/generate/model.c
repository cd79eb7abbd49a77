#include "renderer/generate/model.h"
#include "renderer/blob/builder.h"
#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

void model_finish(struct model *model)
{
    for (uint32_t i = 0; i < model->mesh_count; i++)
        shape_finish(&model->meshes[i].shape);
    for (uint32_t i = 0; i < model->image_count; i++)
        free(model->images[i].rgba);
    memset(model, 0, sizeof *model);
}

uint32_t model_material(
    struct model *model, double r, double g, double b, double roughness, double metallic)
{
    assert(model->material_count < MODEL_MAX_MATERIALS);
    struct psc_material *m = &model->materials[model->material_count];
    *m = psc_material_default();
    m->base_color[0] = (float)r;
    m->base_color[1] = (float)g;
    m->base_color[2] = (float)b;
    m->roughness = (float)roughness;
    m->metallic = (float)metallic;
    return model->material_count++;
}

uint32_t model_mesh(struct model *model, struct shape *shape, uint32_t material)
{
    assert(model->mesh_count < MODEL_MAX_MESHES);
    model->meshes[model->mesh_count] = (struct model_mesh){*shape, material};
    memset(shape, 0, sizeof *shape);
    return model->mesh_count++;
}

uint32_t model_image(struct model *model, uint32_t width, uint32_t height, bool srgb, uint8_t *rgba)
{
    assert(model->image_count < MODEL_MAX_IMAGES);
    model->images[model->image_count] =
        (struct model_image){width, height, srgb, rgba, PSC_REPEAT, 0};
    return model->image_count++;
}

struct psc_texture_ref model_texture(uint32_t texture)
{
    return (struct psc_texture_ref){.texture = (int32_t)texture, .transform = {1, 0, 0, 0, 1, 0}};
}

void model_place_world(struct model *model, uint32_t mesh, const float world[12])
{
    assert(model->instance_count < MODEL_MAX_INSTANCES && mesh < model->mesh_count);
    struct model_instance *instance = &model->instances[model->instance_count++];
    instance->mesh = mesh;
    memcpy(instance->world, world, sizeof instance->world);
}

void model_place(
    struct model *model, uint32_t mesh, double x, double y, double z, double turn_deg, double scale)
{
    double c = cos(turn_deg * M_PI / 180) * scale, s = sin(turn_deg * M_PI / 180) * scale;
    const float world[12] = {(float)c, 0, (float)s, (float)x, 0, (float)scale, 0, (float)y,
        (float)-s, 0, (float)c, (float)z};
    model_place_world(model, mesh, world);
}

void model_look(struct model *model, const double eye[3], const double target[3], double fov_y_deg)
{
    model->camera =
        (struct psc_camera){.up = {0, 1, 0}, .fov_y_deg = (float)fov_y_deg, .name = "main"};
    for (int k = 0; k < 3; k++) {
        model->camera.eye[k] = eye[k];
        model->camera.target[k] = target[k];
    }
}

bool model_to_blob(const struct model *model, const uint8_t source[PEN_ID_BYTES], void **data,
    size_t *bytes, struct pen_error *error)
{
    struct psc_builder *builder = psc_builder_create();
    bool ok = true;
    for (uint32_t i = 0; i < model->material_count; i++)
        psc_builder_add_material(builder, &model->materials[i]);
    for (uint32_t i = 0; i < model->image_count; i++) {
        const struct model_image *image = &model->images[i];
        struct psc_texture texture = {
            .wrap_s = image->wrap, .wrap_t = image->wrap, .nearest = image->nearest};
        texture.image =
            psc_builder_add_image(builder, image->width, image->height, image->srgb, image->rgba);
        psc_builder_add_texture(builder, &texture);
    }
    for (uint32_t i = 0; i < model->mesh_count && ok; i++) {
        const struct shape *s = &model->meshes[i].shape;
        const struct psc_material *material = &model->materials[model->meshes[i].material];
        struct psc_mesh mesh = {.positions = (const float(*)[3])s->positions,
            .normals = (const float(*)[3])s->normals,
            .uv0 = (const float(*)[2])s->uv,
            .vertex_count = s->vertex_count,
            .indices = s->indices,
            .index_count = s->index_count,
            .material = model->meshes[i].material,
            .normal_map = material->normal.texture >= 0 ? &material->normal : NULL};
        uint32_t primitive;
        ok = psc_builder_add_mesh(builder, &mesh, &primitive, error);
    }
    for (uint32_t i = 0; i < model->instance_count; i++)
        psc_builder_add_instance(builder, model->instances[i].mesh, model->instances[i].world);
    if (model->camera.fov_y_deg > 0)
        psc_builder_add_camera(builder, &model->camera);
    ok = ok && psc_builder_finish(builder, source, data, bytes, error);
    psc_builder_destroy(builder);
    return ok;
}
