#include "tests/unit/import_support.h"
#include <stdarg.h>

struct imported import_bytes(const void *data, size_t bytes)
{
    struct imported result = {0};
    const uint8_t source[PEN_ID_BYTES] = {1, 2, 3};
    size_t blob_bytes = 0;
    result.ok =
        pen_import(data, bytes, PEN_IMPORT_SCENE, source, &result.data, &blob_bytes, &result.error);
    if (result.ok && !psc_open_memory(result.data, blob_bytes, &result.scene, &result.error)) {
        fprintf(stderr, "blob refused: %s\n", result.error.message);
        check_failures++;
        result.ok = false;
    }
    return result;
}

struct imported import_json(const char *json)
{
    return import_bytes(json, strlen(json));
}

void imported_free(struct imported *imported)
{
    free(imported->data);
    memset(imported, 0, sizeof *imported);
}

const char *base64(const void *data, size_t bytes)
{
    static char *kept[4];
    static int next;
    static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    const uint8_t *in = data;
    char *out = malloc(bytes / 3 * 4 + 8), *at = out;
    for (size_t i = 0; i < bytes; i += 3) {
        uint32_t left = bytes - i < 3 ? (uint32_t)(bytes - i) : 3, bits = (uint32_t)in[i] << 16;
        if (left > 1)
            bits |= (uint32_t)in[i + 1] << 8;
        if (left > 2)
            bits |= in[i + 2];
        *at++ = digits[bits >> 18];
        *at++ = digits[bits >> 12 & 63];
        *at++ = left > 1 ? digits[bits >> 6 & 63] : '=';
        *at++ = left > 2 ? digits[bits & 63] : '=';
    }
    *at = 0;
    free(kept[next]);
    kept[next] = out;
    next = (next + 1) % 4;
    return out;
}

char *text(const char *format, ...)
{
    char *out = NULL;
    va_list args;
    va_start(args, format);
    if (vasprintf(&out, format, args) < 0)
        abort();
    va_end(args);
    return out;
}

static bool near3(const float a[3], const float b[3])
{
    for (int k = 0; k < 3; k++)
        if (!(fabsf(a[k] - b[k]) <= 1e-5f * (1 + fabsf(b[k]))))
            return false;
    return true;
}

static void world_position(
    const struct psc_scene *scene, const struct psc_instance *instance, uint32_t v, float out[3])
{
    const float *p = scene->positions[v];
    for (int r = 0; r < 3; r++)
        out[r] = instance->world[4 * r] * p[0] + instance->world[4 * r + 1] * p[1] +
                 instance->world[4 * r + 2] * p[2] + instance->world[4 * r + 3];
}

bool draws(const struct psc_scene *scene, const float a[3], const float b[3], const float c[3])
{
    for (uint32_t i = 0; i < scene->instance_count; i++) {
        const struct psc_instance *instance = &scene->instances[i];
        const struct psc_primitive *p = &scene->primitives[instance->primitive];
        for (uint32_t k = 0; k < p->index_count; k += 3) {
            float corner[3][3];
            for (int j = 0; j < 3; j++)
                world_position(
                    scene, instance, scene->indices[p->first_index + k + (uint32_t)j], corner[j]);
            for (int first = 0; first < 3; first++)
                if (near3(corner[first], a) && near3(corner[(first + 1) % 3], b) &&
                    near3(corner[(first + 2) % 3], c))
                    return true;
        }
    }
    return false;
}

uint32_t vertex_at(const struct psc_scene *scene, float x, float y, float z)
{
    for (uint32_t i = 0; i < scene->vertex_count; i++)
        if (near3(scene->positions[i], (const float[3]){x, y, z}))
            return i;
    return UINT32_MAX;
}

bool has_warning(const struct psc_scene *scene, const char *part)
{
    for (uint64_t at = 0; at < scene->warning_bytes; at += strlen(scene->warnings + at) + 1)
        if (strstr(scene->warnings + at, part))
            return true;
    return false;
}
