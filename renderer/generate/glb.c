/* glTF 2.0 binary: a JSON chunk and a BIN chunk. */
#include "protocol/memory.h"
#include "renderer/generate/model.h"
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct bytes {
    char *data;
    size_t count, capacity;
};

struct writer {
    struct bytes json, bin;
    uint32_t views, accessors;
    struct bytes view_json, accessor_json;
};

static void put(struct bytes *b, const void *data, uint64_t count)
{
    b->data = pen_grow(b->data, &b->capacity, b->count + count, 1);
    memcpy(b->data + b->count, data, count);
    b->count += count;
}

__attribute__((format(printf, 2, 3))) static void print(struct bytes *b, const char *format, ...)
{
    char text[1024];
    va_list args;
    va_start(args, format);
    int n = vsnprintf(text, sizeof text, format, args);
    va_end(args);
    if (n < 0 || (size_t)n >= sizeof text)
        abort();
    put(b, text, (uint64_t)n);
}

static void pad(struct bytes *b, char with)
{
    while (b->count % 4)
        put(b, &with, 1);
}

static const char *comma(uint32_t i)
{
    return i ? "," : "";
}

/* A buffer view of its own; target 0: neither vertices nor indices. */
static uint32_t add_view(struct writer *w, const void *data, uint64_t bytes, uint32_t target)
{
    print(&w->view_json, "%s{\"buffer\":0,\"byteOffset\":%llu,\"byteLength\":%llu", comma(w->views),
        (unsigned long long)w->bin.count, (unsigned long long)bytes);
    if (target)
        print(&w->view_json, ",\"target\":%u", target);
    print(&w->view_json, "}");
    put(&w->bin, data, bytes);
    pad(&w->bin, 0);
    return w->views++;
}

static uint32_t add_floats(struct writer *w, const float *data, uint32_t count, uint32_t width)
{
    uint32_t view = add_view(w, data, 4ull * count * width, 34962);
    print(&w->accessor_json,
        "%s{\"bufferView\":%u,\"componentType\":5126,\"count\":%u,\"type\":\"VEC%u\"",
        comma(w->accessors), view, count, width);
    for (int high = 0; high < 2; high++) {
        print(&w->accessor_json, high ? ",\"max\":[" : ",\"min\":[");
        for (uint32_t k = 0; k < width; k++) {
            float x = data[k];
            for (uint32_t i = 1; i < count; i++)
                x = high ? fmaxf(x, data[i * width + k]) : fminf(x, data[i * width + k]);
            print(&w->accessor_json, "%s%.9g", comma(k), x);
        }
        print(&w->accessor_json, "]");
    }
    print(&w->accessor_json, "}");
    return w->accessors++;
}

static uint32_t add_indices(struct writer *w, const uint32_t *indices, uint32_t count)
{
    uint32_t view = add_view(w, indices, 4ull * count, 34963);
    print(&w->accessor_json,
        "%s{\"bufferView\":%u,\"componentType\":5125,\"count\":%u,\"type\":\"SCALAR\"}",
        comma(w->accessors), view, count);
    return w->accessors++;
}

static void write_meshes(struct writer *w, const struct model *model)
{
    print(&w->json, ",\"meshes\":[");
    for (uint32_t i = 0; i < model->mesh_count; i++) {
        const struct shape *s = &model->meshes[i].shape;
        uint32_t position = add_floats(w, *s->positions, s->vertex_count, 3);
        uint32_t normal = add_floats(w, *s->normals, s->vertex_count, 3);
        uint32_t uv = add_floats(w, *s->uv, s->vertex_count, 2);
        uint32_t indices = add_indices(w, s->indices, s->index_count);
        print(&w->json,
            "%s{\"primitives\":[{\"attributes\":{\"POSITION\":%u,\"NORMAL\":%u,\"TEXCOORD_0\":%u},"
            "\"indices\":%u,\"material\":%u}]}",
            comma(i), position, normal, uv, indices, model->meshes[i].material);
    }
    print(&w->json, "]");
}

static void write_images(struct writer *w, const struct model *model)
{
    if (!model->image_count)
        return;
    print(&w->json, ",\"images\":[");
    for (uint32_t i = 0; i < model->image_count; i++) {
        const struct model_image *image = &model->images[i];
        uint64_t bytes;
        uint8_t *png = png_write(image->rgba, image->width, image->height, &bytes);
        print(&w->json, "%s{\"mimeType\":\"image/png\",\"bufferView\":%u}", comma(i),
            add_view(w, png, bytes, 0));
        free(png);
    }
    print(&w->json, "],\"samplers\":[");
    for (uint32_t i = 0; i < model->image_count; i++) {
        uint32_t nearest = model->images[i].nearest;
        /* GL's names: NEAREST 9728, LINEAR 9729, and 9984 to 9987 with levels. */
        uint32_t min = nearest & 8 ? (nearest & 2 ? 9728 : 9729)
                                   : 9984 + (nearest & 2 ? 0 : 1) + (nearest & 4 ? 0 : 2);
        uint32_t wrap = model->images[i].wrap == PSC_CLAMP ? 33071 : 10497;
        print(&w->json, "%s{\"magFilter\":%u,\"minFilter\":%u,\"wrapS\":%u,\"wrapT\":%u}", comma(i),
            nearest & 1 ? 9728 : 9729, min, wrap, wrap);
    }
    print(&w->json, "],\"textures\":[");
    for (uint32_t i = 0; i < model->image_count; i++)
        print(&w->json, "%s{\"source\":%u,\"sampler\":%u}", comma(i), i, i);
    print(&w->json, "]");
}

static void write_materials(struct writer *w, const struct model *model)
{
    print(&w->json, ",\"materials\":[");
    for (uint32_t i = 0; i < model->material_count; i++) {
        const struct psc_material *m = &model->materials[i];
        print(&w->json,
            "%s{\"pbrMetallicRoughness\":{\"baseColorFactor\":[%.9g,%.9g,%.9g,%.9g],"
            "\"metallicFactor\":%.9g,\"roughnessFactor\":%.9g",
            comma(i), m->base_color[0], m->base_color[1], m->base_color[2], m->base_color[3],
            m->metallic, m->roughness);
        if (m->base.texture >= 0)
            print(&w->json, ",\"baseColorTexture\":{\"index\":%d}", m->base.texture);
        print(&w->json, "}");
        if (m->normal.texture >= 0)
            print(&w->json, ",\"normalTexture\":{\"index\":%d,\"scale\":%.9g}", m->normal.texture,
                m->normal_scale);
        if (m->alpha_mode == PSC_MASK)
            print(&w->json, ",\"alphaMode\":\"MASK\",\"alphaCutoff\":%.9g", m->alpha_cutoff);
        if (m->flags & PSC_DOUBLE_SIDED)
            print(&w->json, ",\"doubleSided\":true");
        print(&w->json, "}");
    }
    print(&w->json, "]");
}

/* Column-major, as glTF has it; `m` is row-major 3x4. */
static void write_matrix(struct bytes *json, const float m[12])
{
    print(json, ",\"matrix\":[");
    for (int column = 0; column < 4; column++)
        for (int row = 0; row < 4; row++)
            print(json, "%s%.9g", comma((uint32_t)(4 * column + row)),
                row < 3 ? m[4 * row + column] : column == 3);
    print(json, "]");
}

static void write_camera(struct writer *w, const struct psc_camera *camera)
{
    double back[3], right[3], up[3] = {camera->up[0], camera->up[1], camera->up[2]};
    for (int k = 0; k < 3; k++)
        back[k] = (double)camera->eye[k] - camera->target[k];
    normalize3(back);
    cross3(up, back, right);
    normalize3(right);
    cross3(back, right, up);
    float m[12];
    for (int k = 0; k < 3; k++) {
        m[4 * k] = (float)right[k];
        m[4 * k + 1] = (float)up[k];
        m[4 * k + 2] = (float)back[k];
        m[4 * k + 3] = camera->eye[k];
    }
    print(&w->json, ",{\"name\":\"%s\",\"camera\":0", camera->name);
    write_matrix(&w->json, m);
    print(&w->json,
        "}],\"cameras\":[{\"name\":\"%s\",\"type\":\"perspective\",\"perspective\":{\"yfov\":%.9g,"
        "\"znear\":0.01}}]",
        camera->name, camera->fov_y_deg * M_PI / 180);
}

static void write_nodes(struct writer *w, const struct model *model)
{
    static const float identity[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    bool camera = model->camera.fov_y_deg > 0;
    print(&w->json, ",\"scene\":0,\"scenes\":[{\"nodes\":[");
    for (uint32_t i = 0; i < model->instance_count + camera; i++)
        print(&w->json, "%s%u", comma(i), i);
    print(&w->json, "]}],\"nodes\":[");
    for (uint32_t i = 0; i < model->instance_count; i++) {
        const struct model_instance *instance = &model->instances[i];
        print(&w->json, "%s{\"mesh\":%u", comma(i), instance->mesh);
        if (memcmp(instance->world, identity, sizeof identity))
            write_matrix(&w->json, instance->world);
        print(&w->json, "}");
    }
    if (camera)
        write_camera(w, &model->camera);
    else
        print(&w->json, "]");
}

bool model_to_glb(const struct model *model, void **data, size_t *bytes, struct pen_error *error)
{
    struct writer w = {0};
    *data = NULL;
    *bytes = 0;
    print(&w.json, "{\"asset\":{\"version\":\"2.0\",\"generator\":\"penumbra\"}");
    write_meshes(&w, model);
    write_images(&w, model);
    write_materials(&w, model);
    write_nodes(&w, model);
    print(&w.json, ",\"accessors\":[");
    put(&w.json, w.accessor_json.data, w.accessor_json.count);
    print(&w.json, "],\"bufferViews\":[");
    put(&w.json, w.view_json.data, w.view_json.count);
    print(&w.json, "],\"buffers\":[{\"byteLength\":%llu}]}", (unsigned long long)w.bin.count);
    pad(&w.json, ' ');

    uint64_t total = 12 + 8 + w.json.count + 8 + w.bin.count;
    bool ok = total <= UINT32_MAX;
    if (ok) {
        const uint32_t head[5] = {
            0x46546c67, 2, (uint32_t)total, (uint32_t)w.json.count, 0x4e4f534a};
        const uint32_t bin[2] = {(uint32_t)w.bin.count, 0x004e4942};
        char *file = pen_alloc(total, 1);
        memcpy(file, head, sizeof head);
        memcpy(file + 20, w.json.data, w.json.count);
        memcpy(file + 20 + w.json.count, bin, sizeof bin);
        memcpy(file + 28 + w.json.count, w.bin.data, w.bin.count);
        *data = file;
        *bytes = total;
    } else {
        pen_fail(error, PEN_INVALID, "/triangles", "Larger than a glTF binary can be.");
    }
    free(w.json.data);
    free(w.bin.data);
    free(w.view_json.data);
    free(w.accessor_json.data);
    return ok;
}
