/* Methods, scenes and images as JSON. */
#include "protocol/json_result.h"
#include <string.h>
#include <time.h>

static const char *const type_names[] = {"float", "int", "uint", "flag", "double", "text"};

static void write_row(struct pen_json *json, const struct pen_param *row)
{
    pen_json_object(json, NULL);
    pen_json_string(json, "name", row->name);
    pen_json_string(json, "type", row->choices ? "choice" : type_names[row->type]);
    pen_json_uint(json, "components", row->count);
    pen_json_row_default(json, "default", row);
    if (row->choices) {
        pen_json_array(json, "choices");
        for (uint32_t i = 0; row->choices[i]; i++)
            pen_json_string(json, NULL, row->choices[i]);
        pen_json_end(json);
    } else if (row->type != PEN_PARAM_FLAG && row->type != PEN_PARAM_TEXT) {
        pen_json_double(json, "min", row->min);
        pen_json_double(json, "max", row->max);
        if (row->exclusive_min)
            pen_json_bool(json, "exclusive_min", true);
    }
    if (row->unit)
        pen_json_string(json, "unit", row->unit);
    pen_json_string(json, "help", row->help);
    pen_json_end(json);
}

void pen_technique_write(
    struct pen_json *json, const char *key, const struct pen_technique_info *info)
{
    static const char *const cost_names[] = {"cheap", "medium", "heavy", "reference"};
    pen_json_object(json, key);
    pen_json_string(json, "name", info->name);
    pen_json_string(json, "title", info->title);
    pen_json_string(json, "summary", info->summary);
    pen_json_string(json, "citation", info->citation);
    pen_json_string(json, "artefacts", info->artefacts);
    pen_json_string(json, "cost_class", cost_names[info->cost_class]);
    pen_json_bool(json, "textured", info->textured);
    pen_json_array(json, "params");
    for (uint32_t r = 0; r < info->params.count; r++)
        write_row(json, &info->params.rows[r]);
    pen_json_end(json);
    pen_json_end(json);
}

char *pen_technique_json(const struct pen_technique_info *info)
{
    struct pen_json json = {0};
    pen_technique_write(&json, NULL, info);
    return pen_json_finish(&json, NULL);
}

char *pen_techniques_json(const struct pen_catalogue *catalogue)
{
    struct pen_json json = {0};
    pen_json_object(&json, NULL);
    pen_json_array(&json, "techniques");
    for (uint32_t i = 0; i < catalogue->count; i++)
        pen_technique_write(&json, NULL, catalogue->items[i]);
    pen_json_end(&json);
    pen_json_end(&json);
    return pen_json_finish(&json, NULL);
}

/* RFC 3339, UTC. */
static void write_time(struct pen_json *json, const char *key, int64_t unix_s)
{
    char text[32];
    struct tm parts;
    time_t seconds = (time_t)unix_s;
    if (unix_s && gmtime_r(&seconds, &parts) &&
        strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &parts))
        pen_json_string(json, key, text);
}

static void write_warnings(struct pen_json *json, const char *warnings, size_t bytes)
{
    pen_json_array(json, "warnings");
    for (size_t at = 0; at < bytes;) {
        size_t length = strnlen(warnings + at, bytes - at);
        if (at + length == bytes)
            break; /* not ended by NUL: not one of ours */
        pen_json_string(json, NULL, warnings + at);
        at += length + 1;
    }
    pen_json_end(json);
}

static void write_bounds(struct pen_json *json, const struct pen_scene_info *scene)
{
    if (scene->bounds_min[0] > scene->bounds_max[0]) {
        pen_json_null(json, "bounds");
        return;
    }
    pen_json_object(json, "bounds");
    pen_json_doubles(json, "min", scene->bounds_min, 3);
    pen_json_doubles(json, "max", scene->bounds_max, 3);
    pen_json_end(json);
}

void pen_scene_write(struct pen_json *json, const char *key, const struct pen_scene_info *scene)
{
    const struct {
        const char *key;
        uint64_t value;
    } counts[] = {{"triangles", scene->triangles}, {"vertices", scene->vertices},
        {"primitives", scene->primitives}, {"instances", scene->instances},
        {"materials", scene->materials}, {"textures", scene->textures}, {"images", scene->images},
        {"source_bytes", scene->source_bytes}, {"stored_bytes", scene->blob_bytes},
        {"gpu_bytes", scene->gpu_bytes}};
    pen_json_object(json, key);
    pen_json_id(json, "id", scene->id);
    for (uint32_t i = 0; i < sizeof counts / sizeof *counts; i++)
        pen_json_uint(json, counts[i].key, counts[i].value);
    pen_json_bool(json, "resident", scene->resident);
    write_time(json, "stored_at", scene->stored_unix_s);
    write_bounds(json, scene);
    pen_json_array(json, "cameras");
    for (uint32_t i = 0; i < scene->camera_count; i++) {
        const struct pen_scene_camera *camera = &scene->cameras[i];
        pen_json_object(json, NULL);
        pen_json_uint(json, "index", i);
        pen_json_string(json, "name", camera->name);
        pen_json_doubles(json, "eye", camera->eye, 3);
        pen_json_doubles(json, "target", camera->target, 3);
        pen_json_floats(json, "up", camera->up, 3);
        pen_json_float(json, "fov_y_deg", camera->fov_y_deg);
        pen_json_end(json);
    }
    pen_json_end(json);
    pen_json_array(json, "lights");
    for (uint32_t i = 0; i < scene->light_count; i++) {
        pen_json_object(json, NULL);
        pen_json_string(json, "name", scene->lights[i].name);
        pen_light_write(json, "light", &scene->lights[i].light);
        pen_json_end(json);
    }
    pen_json_end(json);
    pen_json_array(json, "animations");
    for (uint32_t i = 0; i < scene->animation_count; i++) {
        pen_json_object(json, NULL);
        pen_json_uint(json, "index", i);
        pen_json_string(json, "name", scene->animations[i].name);
        pen_json_float(json, "duration_s", scene->animations[i].duration_s);
        pen_json_end(json);
    }
    pen_json_end(json);
    pen_json_array(json, "variants");
    for (uint32_t i = 0; i < scene->variant_count; i++) {
        pen_json_object(json, NULL);
        pen_json_uint(json, "index", i);
        pen_json_string(json, "name", scene->variants[i].name);
        pen_json_end(json);
    }
    pen_json_end(json);
    write_warnings(json, scene->warnings, scene->warning_bytes);
    pen_json_end(json);
}

char *pen_scene_json(const struct pen_scene_info *scene)
{
    struct pen_json json = {0};
    pen_scene_write(&json, NULL, scene);
    return pen_json_finish(&json, NULL);
}

void pen_image_write(struct pen_json *json, const char *key, const struct pen_image_info *image)
{
    pen_json_object(json, key);
    pen_json_id(json, "id", image->id);
    pen_json_uint(json, "width", image->width);
    pen_json_uint(json, "height", image->height);
    pen_json_uint(json, "source_bytes", image->source_bytes);
    pen_json_uint(json, "stored_bytes", image->blob_bytes);
    write_time(json, "stored_at", image->stored_unix_s);
    pen_json_end(json);
}

char *pen_image_json(const struct pen_image_info *image)
{
    struct pen_json json = {0};
    pen_image_write(&json, NULL, image);
    return pen_json_finish(&json, NULL);
}
