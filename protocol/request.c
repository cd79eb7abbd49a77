#include "protocol/request.h"
#include "protocol/technique_info.h"
#include <math.h>
#include <string.h>

const char *const pen_light_type_names[] = {
#define PEN_LIGHT_TYPE(name, text) text,
#include "protocol/light_types.def"
#undef PEN_LIGHT_TYPE
    NULL};
const char *const pen_format_names[] = {"png", "exr", "jpeg", "webp", "tiff", NULL};
const char *const pen_format_mime[] = {
    "image/png", "image/x-exr", "image/jpeg", "image/webp", "image/tiff", NULL};
const char *const pen_tone_map_names[] = {
#define PEN_TONE_MAP(name, text, curve) text,
#include "protocol/tone_maps.def"
#undef PEN_TONE_MAP
    NULL};
const char *const pen_edges_names[] = {"smooth", "none", NULL};
const char *const pen_casters_names[] = {"both", "front", NULL};
const char *const pen_on_deadline_names[] = {"error", "best", NULL};
const char *const pen_priority_names[] = {"interactive", "batch", NULL};
const char *const pen_pattern_names[] = {
    "two-colour", "checker", "stained-glass", "star", "candle-flame", NULL};

static const struct pen_param request_rows[] = {
#define FIELD(type, name, components, ...) PARAM(struct pen_request, name, __VA_ARGS__),
#include "protocol/request.def"
};

#define LOOK_AT PEN_CAMERA_BIT(PEN_CAMERA_LOOK_AT)
#define ORBIT PEN_CAMERA_BIT(PEN_CAMERA_ORBIT)
#define CAMERA(field, ...) PARAM(struct pen_camera, field, __VA_ARGS__)
static const struct pen_param camera_rows[] = {
    CAMERA(index, .def = 0, .min = 0, .max = 65535, .applies = PEN_CAMERA_BIT(PEN_CAMERA_INDEX),
        .help = "Camera of the scene, from 0."),
    CAMERA(eye, .def_v = {0, 0, 1}, .min = -PEN_FAR, .max = PEN_FAR, .unit = "m",
        .applies = LOOK_AT, .help = "Position of the eye, world space."),
    CAMERA(target, .def_v = {0, 0, 0}, .min = -PEN_FAR, .max = PEN_FAR, .unit = "m",
        .applies = LOOK_AT, .help = "Point at the centre of the image, world space."),
    CAMERA(up, .def_v = {0, 1, 0}, .min = -1, .max = 1, .applies = LOOK_AT,
        .help = "Direction that is up in the image."),
    CAMERA(fov_y_deg, .def = 45, .min = 1, .max = 170, .unit = "deg",
        .applies = LOOK_AT | ORBIT | PEN_CAMERA_BIT(PEN_CAMERA_AUTO),
        .help = "Vertical field of view."),
    CAMERA(azimuth_deg, .def = 35, .min = -3600, .max = 3600, .unit = "deg", .applies = ORBIT,
        .help = "Orbit: angle around +y, from +z towards +x."),
    CAMERA(elevation_deg, .def = 25, .min = -89.9, .max = 89.9, .unit = "deg", .applies = ORBIT,
        .help = "Orbit: angle above the horizon."),
    CAMERA(distance, .def = 0, .min = 0, .max = PEN_FAR, .unit = "m", .applies = ORBIT,
        .help = "Orbit: distance from the centre of the bounds; 0 frames them."),
};

#define AREA (PEN_LIGHT_BIT(PEN_LIGHT_RECT) | PEN_LIGHT_BIT(PEN_LIGHT_DISK))
#define ROUND (PEN_LIGHT_BIT(PEN_LIGHT_DISK) | PEN_LIGHT_BIT(PEN_LIGHT_SPHERE))
#define EMITTER (AREA | PEN_LIGHT_BIT(PEN_LIGHT_SPHERE))
#define PUNCTUAL (PEN_LIGHT_BIT(PEN_LIGHT_POINT) | PEN_LIGHT_BIT(PEN_LIGHT_SPOT))
#define LIGHT(field, ...) PARAM(struct pen_light, field, __VA_ARGS__)
static const struct pen_param light_rows[] = {
    LIGHT(position, .def_v = {0, 3, 0}, .min = -PEN_FAR, .max = PEN_FAR, .unit = "m",
        .help = "Centre of the emitter, world space; for a sun only the direction counts."),
    LIGHT(target, .def_v = {0, 0, 0}, .min = -PEN_FAR, .max = PEN_FAR, .unit = "m",
        .help = "Point that the emitter faces, world space."),
    LIGHT(up, .def_v = {0, 1, 0}, .min = -1, .max = 1,
        .help = "Orients the emitter: its +y axis is the part of this vector across its axis."),
    LIGHT(width, .def = 1, .min = 0, .max = PEN_FAR, .exclusive_min = 1, .unit = "m",
        .applies = PEN_LIGHT_BIT(PEN_LIGHT_RECT), .help = "Extent along the emitter's x axis."),
    LIGHT(height, .def = 1, .min = 0, .max = PEN_FAR, .exclusive_min = 1, .unit = "m",
        .applies = PEN_LIGHT_BIT(PEN_LIGHT_RECT), .help = "Extent along the emitter's y axis."),
    LIGHT(radius, .def = 0.5, .min = 0, .max = PEN_FAR, .exclusive_min = 1, .unit = "m",
        .applies = ROUND, .help = "Radius of the disk or sphere."),
    LIGHT(angular_diameter_deg, .def = 0.53, .min = 0, .max = 60, .unit = "deg",
        .applies = PEN_LIGHT_BIT(PEN_LIGHT_SUN), .help = "Apparent diameter of the sun."),
    LIGHT(inner_cone_deg, .def = 0, .min = 0, .max = 89, .unit = "deg",
        .applies = PEN_LIGHT_BIT(PEN_LIGHT_SPOT), .help = "Half angle of full intensity."),
    LIGHT(outer_cone_deg, .def = 45, .min = 0, .max = 89, .exclusive_min = 1, .unit = "deg",
        .applies = PEN_LIGHT_BIT(PEN_LIGHT_SPOT),
        .help = "Half angle where intensity reaches zero."),
    LIGHT(color, .def_v = {1, 1, 1}, .max = 1e3, .help = "Linear RGB factor of the emission."),
    LIGHT(power_w, .def = 100, .min = 0, .max = 1e21, .unit = "W", .applies = EMITTER | PUNCTUAL,
        .help = "Radiant flux; 0 uses radiance instead."),
    LIGHT(radiance, .def = 0, .min = 0, .max = 1e9, .unit = "W m^-2 sr^-1", .applies = EMITTER,
        .help = "Emitted radiance, when power_w is 0."),
    LIGHT(irradiance, .def = 3, .min = 0, .max = 1e9, .unit = "W m^-2",
        .applies = PEN_LIGHT_BIT(PEN_LIGHT_SUN), .help = "On a surface that faces the sun."),
};

static const char layer_help[] = "What the image shows."
#define LAYER(id, name, channels, unit, source, help) " " #name ": " help
#include "protocol/layers.def"
#undef LAYER
                                 " all: every layer that the method has, in one EXR.";

#define OUTPUT(field, ...) PARAM(struct pen_output, field, __VA_ARGS__)
static const struct pen_param output_rows[] = {
    OUTPUT(format, .def = PEN_PNG, .choices = pen_format_names, .help = "File format."),
    OUTPUT(layer, .def = PEN_LAYER_BEAUTY, .choices = pen_layer_names, .help = layer_help),
    OUTPUT(bit_depth, .def = 0, .min = 0, .max = 32, .unit = "bit",
        .help = "8 or 16 for PNG and TIFF, 16 or 32 for EXR; 0: 8, or 16 for EXR."),
    OUTPUT(quality, .def = 92, .min = 1, .max = 100, .help = "JPEG and WebP quality."),
};

#define DELIVERY(field, ...) PARAM(struct pen_delivery, field, __VA_ARGS__)
static const struct pen_param delivery_rows[] = {
    DELIVERY(deadline_ms, .def = 30000, .min = 1, .max = 3600000, .unit = "ms",
        .help = "When the answer is to be ready, counted from the request's last byte."),
    DELIVERY(on_deadline, .def = PEN_DEADLINE_ERROR, .choices = pen_on_deadline_names,
        .help =
            "error: 504 when it is not. best: the picture reached by then, with the samples and "
            "the standard error that it has in the record's `progress`; still 504 when there is "
            "none yet, as with methods that take all their samples at once."),
    DELIVERY(budget_ms, .def = 0, .min = 0, .max = 3600000, .unit = "ms",
        .help =
            "Time that the renderer spends on the picture, of methods that add sample to sample "
            "and of jittered frames: what it has reached by then is the answer, and at least "
            "the first samples. Waiting and other renders do not count. 0: all samples. In a "
            "query, a method's own parameter of this name goes before."),
    DELIVERY(priority, .def = PEN_PRIORITY_INTERACTIVE, .choices = pen_priority_names,
        .help = "Interactive requests are taken first."),
    DELIVERY(progressive, .def = 0,
        .help = "The answer is a row of pictures that get better, as multipart/x-mixed-replace; "
                "the last one is the plain answer. For an <img>; Accept asks for the same."),
    DELIVERY(session, .whole = 1,
        .help =
            "A name of your own for a sequence of frames, one request after the other: a method "
            "that goes on from the frame before (temporal) finds it by this name. Without one "
            "every frame stands for itself, and other methods do not look at it. In a scene "
            "without lights, the light stays where the first frame's camera put it."),
};

struct pen_param_table pen_request_table(void)
{
    return PEN_TABLE(request_rows);
}

struct pen_param_table pen_camera_table(void)
{
    return PEN_TABLE(camera_rows);
}

struct pen_param_table pen_light_table(void)
{
    return PEN_TABLE(light_rows);
}

struct pen_param_table pen_output_table(void)
{
    return PEN_TABLE(output_rows);
}

struct pen_param_table pen_delivery_table(void)
{
    return PEN_TABLE(delivery_rows);
}

bool pen_delivery_is_limited(const struct pen_delivery *delivery)
{
    return delivery->budget_ms || delivery->on_deadline == PEN_DEADLINE_BEST;
}

void pen_light_default(struct pen_light *light, enum pen_light_type type)
{
    memset(light, 0, sizeof *light);
    pen_params_default(pen_light_table(), light);
    light->type = type;
}

void pen_request_default(struct pen_request *request, const struct pen_catalogue *catalogue)
{
    memset(request, 0, sizeof *request);
    pen_params_default(pen_request_table(), request);
    pen_params_default(pen_camera_table(), &request->camera);
    pen_params_default(pen_output_table(), &request->output);
    pen_params_default(pen_delivery_table(), &request->delivery);
    const struct pen_technique_info *info = pen_catalogue_find(catalogue, "pcss");
    if (!info && catalogue->count)
        info = catalogue->items[0];
    if (info) {
        strncpy(request->technique, info->name, sizeof request->technique - 1);
        pen_params_default(info->params, request->technique_params);
    }
}

static float length3(const float v[3])
{
    return sqrtf(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

/* Points that differ by enough for a direction, whatever their distance from the origin, and an up
 * vector. */
static bool is_frame(const double from[3], const double to[3], const float up[3])
{
    double length = 0, size = 0;
    for (int i = 0; i < 3; i++) {
        length = fmax(length, fabs(to[i] - from[i]));
        size = fmax(size, fmax(fabs(from[i]), fabs(to[i])));
    }
    return length > 1e-12 * fmax(size, 1) && length3(up) > 1e-3f;
}

static bool check_rows(struct pen_param_table table, const void *object, uint32_t light_bit,
    const char *pointer, struct pen_error *error)
{
    for (uint32_t r = 0; r < table.count; r++) {
        const struct pen_param *row = &table.rows[r];
        if ((row->applies && light_bit && !(row->applies & light_bit)) ||
            pen_param_is_auto(row, object) || pen_param_is_word(row, object))
            continue;
        if (row->type == PEN_PARAM_TEXT) {
            if (memchr(pen_param_load_text(row, object), 0, row->bytes))
                continue;
            return pen_fail(error, PEN_INVALID, pointer, "%s does not end.", row->name);
        }
        double values[4];
        uint32_t scratch[128]; /* only the range check is wanted, not the store */
        struct pen_param flat = *row;
        flat.offset = 0;
        for (uint32_t i = 0; i < row->count; i++)
            values[i] = pen_param_load(row, object, i);
        if (!pen_param_store(&flat, scratch, values, pointer, error))
            return false;
    }
    return true;
}

static bool rows_are_legible(struct pen_param_table table, const void *object)
{
    for (uint32_t r = 0; r < table.count; r++) {
        const struct pen_param *row = &table.rows[r];
        if (row->type == PEN_PARAM_TEXT && !memchr(pen_param_load_text(row, object), 0, row->bytes))
            return false;
        uint32_t choices = 0;
        while (row->choices && row->choices[choices])
            choices++;
        if (row->choices && !(pen_param_load(row, object, 0) < choices))
            return false;
    }
    return true;
}

bool pen_request_is_legible(
    const struct pen_request *request, const struct pen_catalogue *catalogue)
{
    if (!memchr(request->technique, 0, sizeof request->technique) ||
        request->camera.mode > PEN_CAMERA_ORBIT || request->light_count > PEN_MAX_LIGHTS)
        return false;
    const struct pen_technique_info *info = pen_catalogue_find(catalogue, request->technique);
    bool ok = info && rows_are_legible(info->params, request->technique_params) &&
              rows_are_legible(pen_request_table(), request) &&
              rows_are_legible(pen_camera_table(), &request->camera) &&
              rows_are_legible(pen_output_table(), &request->output) &&
              rows_are_legible(pen_delivery_table(), &request->delivery);
    for (uint32_t i = 0; ok && i < request->light_count; i++) {
        const struct pen_light *light = &request->lights[i];
        ok = light->type < PEN_LIGHT_TYPES && light->texture <= PEN_TEXTURE_PATTERN &&
             light->pattern < sizeof pen_pattern_names / sizeof *pen_pattern_names - 1 &&
             rows_are_legible(pen_light_table(), light);
    }
    return ok;
}

bool pen_request_check(const struct pen_request *request, const struct pen_catalogue *catalogue,
    struct pen_error *error)
{
    if (memchr(request->technique, 0, sizeof request->technique) == NULL)
        return pen_fail(error, PEN_INVALID, "/technique/name", "The method has no valid name.");
    const struct pen_technique_info *info = pen_catalogue_find(catalogue, request->technique);
    if (!info)
        return pen_fail(error, PEN_INVALID, "/technique/name", "There is no method called \"%s\".",
            request->technique);
    if (!check_rows(info->params, request->technique_params, 0, "/technique/params", error) ||
        !check_rows(pen_request_table(), request, 0, "", error) ||
        !check_rows(pen_camera_table(), &request->camera, 0, "/camera", error) ||
        !check_rows(pen_output_table(), &request->output, 0, "/output", error) ||
        !check_rows(pen_delivery_table(), &request->delivery, 0, "", error))
        return false;
    if ((uint64_t)request->width * request->height > PEN_MAX_IMAGE_PIXELS)
        return pen_fail(error, PEN_INVALID, "/width",
            "%u x %u is more than the %u pixels that one image may have.", request->width,
            request->height, PEN_MAX_IMAGE_PIXELS);
    const struct pen_camera *camera = &request->camera;
    if (camera->mode > PEN_CAMERA_ORBIT)
        return pen_fail(error, PEN_INVALID, "/camera", "Unknown camera mode.");
    if (camera->mode == PEN_CAMERA_LOOK_AT && !is_frame(camera->eye, camera->target, camera->up))
        return pen_fail(error, PEN_INVALID, "/camera",
            "The camera needs an eye and a target that differ, and an up vector that is not zero.");
    if (request->light_count > PEN_MAX_LIGHTS)
        return pen_fail(
            error, PEN_INVALID, "/lights", "At most %d lights are allowed.", PEN_MAX_LIGHTS);
    for (uint32_t i = 0; i < request->light_count; i++) {
        const struct pen_light *light = &request->lights[i];
        char pointer[32] = "/lights/0";
        pointer[8] = (char)('0' + i);
        if (light->type >= PEN_LIGHT_TYPES)
            return pen_fail(error, PEN_INVALID, pointer, "Unknown light type.");
        if (!check_rows(pen_light_table(), light, PEN_LIGHT_BIT(light->type), pointer, error))
            return false;
        bool round = light->type == PEN_LIGHT_POINT || light->type == PEN_LIGHT_SPHERE;
        if (!round && !is_frame(light->position, light->target, light->up))
            return pen_fail(error, PEN_INVALID, pointer,
                "The light needs a position and a target that differ, and an up vector.");
        if (light->type == PEN_LIGHT_SPOT && light->inner_cone_deg >= light->outer_cone_deg)
            return pen_fail(
                error, PEN_INVALID, pointer, "inner_cone_deg must be smaller than outer_cone_deg.");
        if (light->texture > PEN_TEXTURE_PATTERN ||
            (light->texture == PEN_TEXTURE_PATTERN &&
                light->pattern >= sizeof pen_pattern_names / sizeof *pen_pattern_names - 1))
            return pen_fail(error, PEN_INVALID, pointer, "Unknown emission pattern.");
        if (light->texture && light->type != PEN_LIGHT_RECT)
            return pen_fail(
                error, PEN_INVALID, pointer, "Only rect lights take an emission texture.");
    }
    const struct pen_output *output = &request->output;
    uint32_t bits = output->bit_depth;
    bool depth_ok = bits == 0 || (bits == 8 && output->format != PEN_EXR) ||
                    (bits == 16 && output->format != PEN_JPEG && output->format != PEN_WEBP) ||
                    (bits == 32 && output->format == PEN_EXR);
    if (!depth_ok)
        return pen_fail(error, PEN_INVALID, "/output/bit_depth",
            "%s cannot have %u bits per channel.", pen_format_names[output->format], bits);
    if (output->layer == PEN_LAYER_BEAUTY && output->format == PEN_JPEG &&
        pen_request_is_transparent(request))
        return pen_fail(error, PEN_INVALID, "/output/format",
            "jpeg has no transparency: ask for png, webp, tiff or exr, or name a background.");
    if (output->layer == PEN_LAYER_ALL && output->format != PEN_EXR)
        return pen_fail(
            error, PEN_INVALID, "/output/layer", "All layers in one file need the exr format.");
    return true;
}

bool pen_request_is_stateful(
    const struct pen_request *request, const struct pen_catalogue *catalogue)
{
    const struct pen_technique_info *info = pen_catalogue_find(catalogue, request->technique);
    return request->delivery.session[0] && info && info->keeps_history;
}

bool pen_request_is_transparent(const struct pen_request *request)
{
    return request->background[0] == PEN_WORD;
}

void pen_id_to_hex(const uint8_t id[PEN_ID_BYTES], char text[PEN_ID_HEX + 1])
{
    static const char digits[] = "0123456789abcdef";
    for (int i = 0; i < PEN_ID_BYTES; i++) {
        text[2 * i] = digits[id[i] >> 4];
        text[2 * i + 1] = digits[id[i] & 15];
    }
    text[PEN_ID_HEX] = 0;
}

bool pen_id_from_hex(const char *text, uint8_t id[PEN_ID_BYTES])
{
    for (int i = 0; i < PEN_ID_HEX; i++) {
        char c = text[i];
        uint8_t nibble;
        if (c >= '0' && c <= '9')
            nibble = (uint8_t)(c - '0');
        else if (c >= 'a' && c <= 'f')
            nibble = (uint8_t)(c - 'a' + 10);
        else
            return false;
        id[i / 2] = (uint8_t)(i % 2 ? id[i / 2] | nibble : nibble << 4);
    }
    return text[PEN_ID_HEX] == 0;
}
