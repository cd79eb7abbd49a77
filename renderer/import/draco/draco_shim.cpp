#include "renderer/import/draco/draco_shim.h"
#include <draco/compression/decode.h>
#include <draco/mesh/mesh.h>
#include <memory>

struct draco_mesh {
    std::unique_ptr<draco::Mesh> mesh;
};

struct draco_mesh *draco_mesh_decode(const uint8_t *data, size_t bytes, struct pen_error *error)
{
    try {
        draco::DecoderBuffer buffer;
        buffer.Init(reinterpret_cast<const char *>(data), bytes);
        draco::Decoder decoder;
        auto decoded = decoder.DecodeMeshFromBuffer(&buffer);
        if (decoded.ok() && decoded.value())
            return new draco_mesh{std::move(decoded).value()};
        pen_fail(error, PEN_INVALID, "", "the Draco data are damaged");
    } catch (const std::bad_alloc &) {
        pen_fail(error, PEN_TOO_BIG, "", "the Draco data need more memory than an import may use");
    } catch (const std::length_error &) {
        pen_fail(error, PEN_TOO_BIG, "", "the Draco data need more memory than an import may use");
    } catch (...) {
        pen_fail(error, PEN_INVALID, "", "the Draco data are damaged");
    }
    return nullptr;
}

void draco_mesh_free(struct draco_mesh *mesh)
{
    delete mesh;
}

uint32_t draco_mesh_points(const struct draco_mesh *mesh)
{
    return mesh->mesh->num_points();
}

uint32_t draco_mesh_faces(const struct draco_mesh *mesh)
{
    return mesh->mesh->num_faces();
}

void draco_mesh_indices(const struct draco_mesh *mesh, uint32_t *indices)
{
    for (draco::FaceIndex f(0); f < mesh->mesh->num_faces(); ++f)
        for (size_t k = 0; k < 3; k++)
            *indices++ = mesh->mesh->face(f)[k].value();
}

template <typename T>
static bool read(
    const draco::PointAttribute &attribute, uint32_t points, uint32_t components, void *values)
{
    T *value = static_cast<T *>(values);
    for (draco::PointIndex p(0); p < points; ++p, value += components) {
        draco::AttributeValueIndex index = attribute.mapped_index(p);
        if (index.value() >= attribute.size() ||
            !attribute.ConvertValue<T>(index, static_cast<int8_t>(components), value))
            return false;
    }
    return true;
}

bool draco_mesh_attribute(const struct draco_mesh *mesh, uint32_t id, uint32_t component,
    uint32_t components, void *values)
{
    const draco::PointAttribute *found = nullptr;
    uint32_t points = mesh->mesh->num_points();
    for (int32_t i = 0; i < mesh->mesh->num_attributes(); i++)
        if (mesh->mesh->attribute(i)->unique_id() == id)
            found = mesh->mesh->attribute(i);
    if (!found || found->num_components() != static_cast<int>(components) ||
        (!found->is_mapping_identity() && found->indices_map_size() < points))
        return false;
    switch (component) {
    case 5120:
        return read<int8_t>(*found, points, components, values);
    case 5121:
        return read<uint8_t>(*found, points, components, values);
    case 5122:
        return read<int16_t>(*found, points, components, values);
    case 5123:
        return read<uint16_t>(*found, points, components, values);
    case 5125:
        return read<uint32_t>(*found, points, components, values);
    case 5126:
        return read<float>(*found, points, components, values);
    }
    return false;
}
