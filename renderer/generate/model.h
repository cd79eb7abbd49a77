/* One description of a scene, written out as a blob or as a glTF binary. Private to generate/. */
#pragma once
#include "renderer/blob/pscene.h"
#include "renderer/generate/shape.h"

#define MODEL_MAX_MESHES 32
#define MODEL_MAX_MATERIALS 16
#define MODEL_MAX_IMAGES 16
#define MODEL_MAX_INSTANCES 512

struct model_mesh {
    struct shape shape;
    uint32_t material;
};

struct model_image {
    uint32_t width, height;
    bool srgb;
    uint8_t *rgba;
    uint32_t wrap, nearest; /* as in struct psc_texture: each image is used by one texture */
};

struct model_instance {
    uint32_t mesh;
    float world[12];
};

struct model {
    struct model_mesh meshes[MODEL_MAX_MESHES];
    struct psc_material materials[MODEL_MAX_MATERIALS];
    struct model_image images[MODEL_MAX_IMAGES];
    struct model_instance instances[MODEL_MAX_INSTANCES];
    uint32_t mesh_count, material_count, image_count, instance_count;
    struct psc_camera camera; /* fov_y_deg 0: none */
};

void model_finish(struct model *model);

struct pen_generated_options;

/* A diffuse-and-specular material without textures; linear colour. */
uint32_t model_material(
    struct model *model, double r, double g, double b, double roughness, double metallic);
/* Takes over the shape. */
uint32_t model_mesh(struct model *model, struct shape *shape, uint32_t material);
/* Takes over rgba (from malloc). Returns the texture's number. */
uint32_t model_image(
    struct model *model, uint32_t width, uint32_t height, bool srgb, uint8_t *rgba);
struct psc_texture_ref model_texture(uint32_t texture);
/* Turned by `turn_deg` about +y, scaled, then moved. */
void model_place(struct model *model, uint32_t mesh, double x, double y, double z, double turn_deg,
    double scale);
void model_place_world(struct model *model, uint32_t mesh, const float world[12]);
void model_look(struct model *model, const double eye[3], const double target[3], double fov_y_deg);

/* Each fills an empty model; options are checked and complete. */
void model_closed_form(struct model *model, const struct pen_generated_options *options);
void model_demo(struct model *model, const struct pen_generated_options *options);
void model_load(struct model *model, const struct pen_generated_options *options);

/* A fluted column of `height`, with base and capital, standing on y = 0; `detail` 1 is about 5,000
 * triangles, and their number grows with its square. */
void shape_column(struct shape *shape, double height, double radius, double detail);

/* RGBA8 rows, top first, as an uncompressed PNG; rgb only when every alpha is 255. Caller frees. */
uint8_t *png_write(const uint8_t *rgba, uint32_t width, uint32_t height, uint64_t *bytes);

bool model_to_blob(const struct model *model, const uint8_t source[PEN_ID_BYTES], void **data,
    size_t *bytes, struct pen_error *error);
bool model_to_glb(const struct model *model, void **data, size_t *bytes, struct pen_error *error);
