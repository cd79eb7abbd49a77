/* pose_dump FILE [ANIMATION TIME]...
 * The file's rest pose and the poses asked for, one JSON object per line: bounds, and the corners of
 * the triangles in world space with their normals, always in the same order. */
#include "renderer/import/import.h"
#include "renderer/pose/pose.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static void print_vector(const double v[3], char end)
{
    printf("[%.12g,%.12g,%.12g]%c", v[0], v[1], v[2], end);
}

static void place(const struct psc_scene *scene, const float m[12], const float p[3], double out[3])
{
    for (int r = 0; r < 3; r++)
        out[r] = scene->header->origin[r] + (double)m[4 * r] * p[0] + (double)m[4 * r + 1] * p[1] +
                 (double)m[4 * r + 2] * p[2] + m[4 * r + 3];
}

/* By the cofactor matrix; its sign keeps normals on their side under mirroring. */
static void turn(const float m[12], const int16_t n[4], double out[3])
{
    double determinant = 0, length = 0;
    for (int r = 0; r < 3; r++) {
        const float *a = m + 4 * ((r + 1) % 3), *b = m + 4 * ((r + 2) % 3);
        double row[3];
        for (int c = 0; c < 3; c++)
            row[c] =
                (double)a[(c + 1) % 3] * b[(c + 2) % 3] - (double)a[(c + 2) % 3] * b[(c + 1) % 3];
        out[r] = row[0] * n[0] + row[1] * n[1] + row[2] * n[2];
        length += out[r] * out[r];
        if (r == 0)
            determinant = m[0] * row[0] + m[1] * row[1] + m[2] * row[2];
    }
    for (int r = 0; r < 3 && length > 0; r++)
        out[r] *= (determinant < 0 ? -1 : 1) / sqrt(length);
}

static void print_pose(const struct psc_scene *scene, float duration_s)
{
    const struct psc_header *h = scene->header;
    double low[3], high[3], v[3];
    for (int k = 0; k < 3; k++)
        low[k] = h->origin[k] + h->bounds_min[k], high[k] = h->origin[k] + h->bounds_max[k];
    printf("{\"animations\":%u,\"duration_s\":%.9g,\"min\":", scene->motion.animation_count,
        duration_s);
    print_vector(low, ',');
    printf("\"max\":");
    print_vector(high, ',');
    printf("\"corners\":[");
    bool first = true;
    for (uint32_t i = 0; i < scene->instance_count; i++) {
        const struct psc_instance *instance = &scene->instances[i];
        const struct psc_primitive *p = &scene->primitives[instance->primitive];
        for (uint32_t k = 0; k < p->index_count && !(instance->flags & PSC_HIDDEN); k++) {
            uint32_t vertex = scene->indices[p->first_index + k];
            printf(first ? "[" : ",[");
            first = false;
            place(scene, instance->world, scene->positions[vertex], v);
            print_vector(v, ',');
            turn(instance->world, scene->attributes[vertex].normal, v);
            print_vector(v, ']');
        }
    }
    printf("]}\n");
}

static void *read_file(const char *name, size_t *bytes)
{
    FILE *file = fopen(name, "rb");
    char *data = NULL;
    if (!file || fseek(file, 0, SEEK_END) || (*bytes = (size_t)ftell(file)) == 0 ||
        fseek(file, 0, SEEK_SET) || !(data = malloc(*bytes)) ||
        fread(data, 1, *bytes, file) != *bytes) {
        fprintf(stderr, "%s cannot be read.\n", name);
        exit(2);
    }
    fclose(file);
    return data;
}

int main(int argc, char **argv)
{
    const uint8_t source[PEN_ID_BYTES] = {0};
    struct pen_error error = {0};
    struct psc_scene scene;
    size_t bytes, blob_bytes;
    void *blob;
    if (argc < 2)
        return 2;
    void *data = read_file(argv[1], &bytes);
    bool ok = pen_import(data, bytes, PEN_IMPORT_SCENE, source, &blob, &blob_bytes, &error) &&
              psc_open_memory(blob, blob_bytes, &scene, &error);
    free(data);
    if (!ok) {
        fprintf(stderr, "%s\n", error.message);
        return 1;
    }
    print_pose(&scene, 0);
    struct pose *pose = pose_create(&scene);
    for (int i = 2; ok && i + 1 < argc; i += 2) {
        int32_t animation;
        uint32_t changes;
        float time_s = strtof(argv[i + 1], NULL);
        ok = pose_find(&scene, argv[i], &animation, &error) &&
             pose_set(pose, animation, pose_clamp(&scene, animation, time_s), &changes, &error);
        if (ok)
            print_pose(pose_scene(pose),
                animation < 0 ? 0 : scene.motion.animations[animation].duration_s);
        else
            fprintf(stderr, "%s\n", error.message);
    }
    pose_destroy(pose);
    free(blob);
    return ok ? 0 : 1;
}
