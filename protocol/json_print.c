/* Requests as JSON: the inverse of json_request.c. */
#include "protocol/json_result.h"

/* The rows of `table` that have the bit in their mask (0: every row), without those whose mask is
 * exactly `except`. */
static void write_rows(struct pen_json *json, struct pen_param_table table, const void *object,
    uint32_t bit, uint32_t except)
{
    for (uint32_t r = 0; r < table.count; r++) {
        const struct pen_param *row = &table.rows[r];
        if (bit && row->applies && !(row->applies & bit))
            continue;
        if (!except || row->applies != except)
            pen_json_row(json, row, object);
    }
}

static void write_camera(struct pen_json *json, const struct pen_camera *camera)
{
    const uint32_t orbit = PEN_CAMERA_BIT(PEN_CAMERA_ORBIT);
    pen_json_object(json, "camera");
    if (camera->mode == PEN_CAMERA_ORBIT) {
        struct pen_param_table table = pen_camera_table();
        pen_json_object(json, "orbit");
        for (uint32_t r = 0; r < table.count; r++)
            if (table.rows[r].applies == orbit)
                pen_json_row(json, &table.rows[r], camera);
        pen_json_end(json);
    }
    write_rows(json, pen_camera_table(), camera, PEN_CAMERA_BIT(camera->mode), orbit);
    pen_json_end(json);
}

void pen_light_write(struct pen_json *json, const char *key, const struct pen_light *light)
{
    struct pen_param_table table = pen_light_table();
    const struct pen_param *power = pen_param_find(table, "power_w");
    const struct pen_param *radiance = pen_param_find(table, "radiance");
    uint32_t bit = PEN_LIGHT_BIT(light->type);
    pen_json_object(json, key);
    pen_json_string(json, "type", pen_light_type_names[light->type]);
    for (uint32_t r = 0; r < table.count; r++) {
        const struct pen_param *row = &table.rows[r];
        if (row->applies && !(row->applies & bit))
            continue;
        /* Only one of the two is in force, and only one may be given. */
        bool by_power = light->power_w != 0 || !(radiance->applies & bit);
        if ((row == power && !by_power) || (row == radiance && by_power))
            continue;
        pen_json_row(json, row, light);
    }
    if (light->texture) {
        pen_json_object(json, "texture");
        if (light->texture == PEN_TEXTURE_IMAGE)
            pen_json_id(json, "image", light->image);
        else
            pen_json_string(json, "pattern", pen_pattern_names[light->pattern]);
        pen_json_end(json);
    }
    pen_json_end(json);
}

void pen_request_write(struct pen_json *json, const char *key, const struct pen_request *request,
    const struct pen_catalogue *catalogue)
{
    const struct pen_technique_info *info = pen_catalogue_find(catalogue, request->technique);
    pen_json_object(json, key);
    pen_json_object(json, "technique");
    pen_json_string(json, "name", request->technique);
    if (info) {
        pen_json_object(json, "params");
        write_rows(json, info->params, request->technique_params, 0, 0);
        pen_json_end(json);
    }
    pen_json_end(json);
    write_camera(json, &request->camera);
    if (request->lights_given) {
        pen_json_array(json, "lights");
        for (uint32_t i = 0; i < request->light_count; i++)
            pen_light_write(json, NULL, &request->lights[i]);
        pen_json_end(json);
    }
    write_rows(json, pen_request_table(), request, 0, 0);
    pen_json_object(json, "output");
    write_rows(json, pen_output_table(), &request->output, 0, 0);
    pen_json_end(json);
    write_rows(json, pen_delivery_table(), &request->delivery, 0, 0);
    pen_json_end(json);
}

char *pen_request_json(const struct pen_request *request, const struct pen_catalogue *catalogue)
{
    struct pen_json json = {0};
    pen_request_write(&json, NULL, request, catalogue);
    return pen_json_finish(&json, NULL);
}
