#include "protocol/json_sequence.h"
#include "protocol/json_reader.h"
#include "protocol/json_scan.h"
#include "protocol/keyframes.h"
#include "protocol/memory.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define TURNTABLE_FRAMES 36

const char *const pen_interpolation_names[] = {"linear", "cubic", NULL};
const char *const pen_archive_names[] = {"zip", "webp", "none", NULL};

#define OPTION(field, ...) PARAM(struct pen_sequence_options, field, __VA_ARGS__)
static const struct pen_param option_rows[] = {
    OPTION(frames, .def = 0, .min = 0, .max = PEN_SEQUENCE_FRAMES, .unit = "frames",
        .help = "How many. 0: as many as there are views, all up to the last keyframe, else 36."),
    OPTION(fps, .def = 24, .min = 0.01, .max = 1000, .unit = "frames/s",
        .help = "Frames per second, of the file's own animation and of an animated picture."),
    OPTION(interpolation, .def = PEN_LINEAR, .choices = pen_interpolation_names,
        .help = "Between keyframes. linear: straight from one to the next. cubic: a curve whose "
                "slope at a keyframe is that of the line between its neighbours; what cannot be "
                "negative stays between its two keyframes."),
    OPTION(archive, .def = PEN_ARCHIVE_ZIP, .choices = pen_archive_names,
        .help = "What all frames together are at the end. zip: a file of them. webp: an animated "
                "picture of them, which loops; output.format must be webp. none: nothing."),
};

#define TURN(field, ...) PARAM(struct pen_turntable, field, __VA_ARGS__)
static const struct pen_param turntable_rows[] = {
    TURN(turns, .def = 1, .min = -100, .max = 100, .unit = "turns",
        .help = "How often the camera goes around, towards +x from +z; negative: the other way."),
    TURN(azimuth_deg, .def = 0, .min = -3600, .max = 3600, .unit = "deg",
        .help = "Where it begins: angle around +y, from +z towards +x."),
    TURN(elevation_deg, .def = 25, .min = -89.9, .max = 89.9, .unit = "deg",
        .help = "Angle above the horizon."),
    TURN(distance, .def = 0, .min = 0, .max = PEN_FAR, .unit = "m",
        .help = "Distance from the centre of the bounds; 0 frames them."),
};

struct pen_param_table pen_sequence_table(void)
{
    return PEN_TABLE(option_rows);
}

struct pen_param_table pen_turntable_table(void)
{
    return PEN_TABLE(turntable_rows);
}

/* ---- the body ---- */

struct reader {
    const struct pen_catalogue *catalogue;
    struct pen_sequence *sequence;
    struct pen_error *error;
};

/* The error of a part that was read as a request of its own: its pointer begins behind `skip`. */
static bool move_pointer(struct pen_error *error, const char *place, const char *skip)
{
    char moved[sizeof error->pointer];
    size_t bytes = strlen(skip);
    const char *rest = error->pointer + (strncmp(error->pointer, skip, bytes) ? 0 : bytes);
    snprintf(moved, sizeof moved, "%s%s", place, rest);
    memcpy(error->pointer, moved, sizeof moved);
    return false;
}

/* Takes a member out of an object, which has at most one of the name. */
static bool take(
    cJSON *object, const char *key, const char *pointer, cJSON **member, struct pen_error *error)
{
    *member = cJSON_DetachItemFromObjectCaseSensitive(object, key);
    if (!cJSON_GetObjectItemCaseSensitive(object, key))
        return true;
    cJSON_Delete(*member);
    *member = NULL;
    return pen_fail(error, PEN_INVALID, pointer, "The key \"%s\" is given twice.", key);
}

static bool read_turntable(struct reader *r, const cJSON *node)
{
    static const char place[] = "/sequence/turntable";
    if (r->sequence->request.camera.mode != PEN_CAMERA_AUTO)
        return pen_fail(r->error, PEN_INVALID, "/camera",
            "A turntable says where the camera is: camera takes only fov_y_deg beside it.");
    r->sequence->turns = true;
    return pen_rows_from_tree(
        node, pen_turntable_table(), &r->sequence->turntable, place, r->error);
}

/* One camera, as in a request. */
static bool read_camera(struct reader *r, cJSON *node, const char *place, struct pen_camera *camera)
{
    struct pen_request request;
    cJSON *root = cJSON_CreateObject();
    cJSON_AddItemReferenceToObject(root, "camera", node);
    bool ok = pen_request_from_tree(root, false, r->catalogue, &request, r->error) ||
              move_pointer(r->error, place, "/camera");
    cJSON_Delete(root);
    *camera = request.camera;
    return ok;
}

static bool read_views(struct reader *r, const cJSON *list)
{
    struct pen_sequence *s = r->sequence;
    int count = cJSON_GetArraySize(list);
    if (!cJSON_IsArray(list) || count < 1 || count > PEN_SEQUENCE_FRAMES)
        return pen_fail(r->error, PEN_INVALID, "/sequence/views",
            "views must be a list of 1 to %d cameras.", PEN_SEQUENCE_FRAMES);
    s->views = pen_alloc_zero((size_t)count, sizeof *s->views);
    for (cJSON *item = list->child; item; item = item->next) {
        char place[48];
        snprintf(place, sizeof place, "/sequence/views/%u", s->view_count);
        if (!read_camera(r, item, place, &s->views[s->view_count++]))
            return false;
    }
    return true;
}

static bool read_keyframe(
    struct reader *r, cJSON *node, const char *place, struct pen_keyframe *key)
{
    struct pen_request request;
    cJSON *number = NULL;
    if (!cJSON_IsObject(node))
        return pen_fail(r->error, PEN_INVALID, place, "A keyframe must be an object.");
    if (!take(node, "frame", place, &number, r->error))
        return false;
    double frame = cJSON_IsNumber(number) ? number->valuedouble : -1;
    cJSON_Delete(number);
    if (!(frame >= 0 && frame < PEN_SEQUENCE_FRAMES && frame == floor(frame)))
        return pen_fail(r->error, PEN_INVALID, place,
            "A keyframe needs frame, a whole number from 0 to %d.", PEN_SEQUENCE_FRAMES - 1);
    for (const cJSON *member = node->child; member; member = member->next)
        if (strcmp(member->string, "camera") && strcmp(member->string, "lights"))
            return pen_fail(r->error, PEN_INVALID, place,
                "A keyframe takes only frame, camera and lights, not \"%.40s\".", member->string);
    if (!pen_request_from_tree(node, false, r->catalogue, &request, r->error))
        return move_pointer(r->error, place, "");
    key->frame = (uint32_t)frame;
    key->has_camera = cJSON_GetObjectItemCaseSensitive(node, "camera");
    key->has_lights = request.lights_given;
    key->camera = request.camera;
    key->light_count = request.light_count;
    memcpy(key->lights, request.lights, sizeof key->lights);
    return key->has_camera || key->has_lights ||
           pen_fail(r->error, PEN_INVALID, place, "A keyframe has a camera, lights or both.");
}

/* Of a table's rows that can be between two values. */
static bool goes_between(const struct pen_param *row, const void *object)
{
    return pen_param_is_real(row) && !pen_param_is_auto(row, object) &&
           !pen_param_is_word(row, object);
}

/* What cannot be between two values must be the same in both, and so must what only 0 says. */
static const struct pen_param *first_unlike(
    struct pen_param_table table, uint32_t bit, const void *a, const void *b)
{
    const struct pen_param *row = table.rows;
    for (uint32_t i = 0; i < table.count; i++, row++) {
        if (row->applies && !(row->applies & bit))
            continue;
        bool means_zero = !strcmp(row->name, "distance") || !strcmp(row->name, "power_w");
        if (!goes_between(row, a) || !goes_between(row, b)
                ? memcmp((const char *)a + row->offset, (const char *)b + row->offset, row->bytes)
                : means_zero && (pen_param_load(row, a, 0) > 0) != (pen_param_load(row, b, 0) > 0))
            return row;
    }
    return NULL;
}

static bool check_cameras(struct reader *r, const char *place, const struct pen_keyframe *before,
    const struct pen_keyframe *key)
{
    const struct pen_param *unlike;
    if (key->camera.mode != PEN_CAMERA_LOOK_AT && key->camera.mode != PEN_CAMERA_ORBIT)
        return pen_fail(
            r->error, PEN_INVALID, place, "The camera of a keyframe has an eye or an orbit.");
    if (!before)
        return true;
    if (before->camera.mode != key->camera.mode)
        return pen_fail(r->error, PEN_INVALID, place,
            "The cameras of all keyframes have an eye, or all are in orbit.");
    unlike = first_unlike(
        pen_camera_table(), PEN_CAMERA_BIT(key->camera.mode), &before->camera, &key->camera);
    return !unlike || pen_fail(r->error, PEN_INVALID, place,
                          "The camera's %s must be 0 in all keyframes or in none.", unlike->name);
}

static bool check_lights(struct reader *r, const char *place, const struct pen_keyframe *before,
    const struct pen_keyframe *key)
{
    if (!before)
        return true;
    if (before->light_count != key->light_count)
        return pen_fail(
            r->error, PEN_INVALID, place, "All keyframes with lights have as many of them.");
    for (uint32_t i = 0; i < key->light_count; i++) {
        const struct pen_light *a = &before->lights[i], *b = &key->lights[i];
        if (a->type != b->type || a->texture != b->texture || a->pattern != b->pattern ||
            memcmp(a->image, b->image, sizeof a->image))
            return pen_fail(r->error, PEN_INVALID, place,
                "Light %u has the same type and texture in all keyframes.", i);
        const struct pen_param *unlike =
            first_unlike(pen_light_table(), PEN_LIGHT_BIT(a->type), a, b);
        if (unlike)
            return pen_fail(r->error, PEN_INVALID, place,
                "%s of light %u must be 0 in all keyframes or in none.", unlike->name, i);
    }
    return true;
}

static bool read_keyframes(struct reader *r, const cJSON *list)
{
    struct pen_sequence *s = r->sequence;
    const struct pen_keyframe *camera = NULL, *lights = NULL;
    int count = cJSON_GetArraySize(list);
    if (!cJSON_IsArray(list) || count < 1 || count > PEN_SEQUENCE_KEYS)
        return pen_fail(r->error, PEN_INVALID, "/sequence/keyframes",
            "keyframes must be a list of 1 to %d of them.", PEN_SEQUENCE_KEYS);
    s->keys = pen_alloc_zero((size_t)count, sizeof *s->keys);
    for (cJSON *item = list->child; item; item = item->next) {
        struct pen_keyframe *key = &s->keys[s->key_count];
        char place[48];
        snprintf(place, sizeof place, "/sequence/keyframes/%u", s->key_count);
        if (!read_keyframe(r, item, place, key))
            return false;
        if (s->key_count && key->frame <= key[-1].frame)
            return pen_fail(r->error, PEN_INVALID, place,
                "Keyframes come in order, each behind the one before.");
        if ((key->has_camera && !check_cameras(r, place, camera, key)) ||
            (key->has_lights && !check_lights(r, place, lights, key)))
            return false;
        camera = key->has_camera ? key : camera;
        lights = key->has_lights ? key : lights;
        s->key_count++;
    }
    return true;
}

static bool read_sequence(struct reader *r, cJSON *node)
{
    static const struct {
        const char *key, *pointer;
        bool (*read)(struct reader *r, const cJSON *node);
    } kinds[] = {{"turntable", "/sequence/turntable", read_turntable},
        {"views", "/sequence/views", read_views}};
    struct pen_sequence *s = r->sequence;
    cJSON *parts[3] = {0};
    bool ok = cJSON_IsObject(node) ||
              pen_fail(r->error, PEN_INVALID, "/sequence", "sequence must be an object.");
    for (int i = 0; ok && i < 2; i++)
        ok = take(node, kinds[i].key, kinds[i].pointer, &parts[i], r->error);
    ok = ok && take(node, "keyframes", "/sequence/keyframes", &parts[2], r->error) &&
         pen_rows_from_tree(node, pen_sequence_table(), &s->options, "/sequence", r->error);
    if (ok && !!parts[0] + !!parts[1] + !!parts[2] > 1)
        ok = pen_fail(r->error, PEN_INVALID, "/sequence",
            "turntable, views and keyframes exclude each other.");
    for (int i = 0; ok && i < 2; i++)
        ok = !parts[i] || kinds[i].read(r, parts[i]);
    ok = ok && (!parts[2] || read_keyframes(r, parts[2]));
    for (int i = 0; i < 3; i++)
        cJSON_Delete(parts[i]);
    return ok;
}

/* How many frames, when that is left open. */
static bool count_frames(struct reader *r)
{
    struct pen_sequence *s = r->sequence;
    uint32_t *frames = &s->options.frames;
    if (s->view_count && *frames && *frames != s->view_count)
        return pen_fail(
            r->error, PEN_INVALID, "/sequence/frames", "There are %u views.", s->view_count);
    if (!*frames)
        *frames = s->view_count  ? s->view_count
                  : s->key_count ? s->keys[s->key_count - 1].frame + 1
                                 : TURNTABLE_FRAMES;
    if (s->options.archive == PEN_ARCHIVE_WEBP && s->request.output.format != PEN_WEBP)
        return pen_fail(r->error, PEN_INVALID, "/sequence/archive",
            "An animated picture is made of frames that are webp: ask for output.format webp.");
    return true;
}

static bool check_frames(struct reader *r)
{
    for (uint32_t i = 0; i < r->sequence->options.frames; i++) {
        struct pen_request request;
        struct pen_error fault = {0};
        pen_sequence_frame(r->sequence, i, &request);
        if (!pen_request_check(&request, r->catalogue, &fault))
            return pen_fail(
                r->error, PEN_INVALID, "/sequence", "Frame %u: %.400s", i, fault.message);
    }
    return true;
}

static bool read_scene(struct reader *r, cJSON *root)
{
    cJSON *scene;
    if (!take(root, "scene", "/scene", &scene, r->error))
        return false;
    bool ok =
        cJSON_IsString(scene) && pen_id_from_hex(scene->valuestring, r->sequence->request.scene);
    cJSON_Delete(scene);
    return ok || pen_fail(r->error, PEN_INVALID, "/scene",
                     "scene must be the id of a scene: 64 lower-case hexadecimal digits.");
}

static bool read_root(struct reader *r, cJSON *root, const char *excluded, bool with_scene)
{
    struct pen_request *request = &r->sequence->request;
    uint8_t scene[PEN_ID_BYTES];
    cJSON *node = NULL;
    if (!cJSON_IsObject(root))
        return pen_fail(r->error, PEN_INVALID, "", "An object is expected here.");
    if (with_scene && !read_scene(r, root))
        return false;
    memcpy(scene, request->scene, sizeof scene);
    bool ok = take(root, "sequence", "/sequence", &node, r->error) &&
              pen_request_from_tree(root, false, r->catalogue, request, r->error);
    memcpy(request->scene, scene, sizeof scene);
    if (ok && excluded && !strcmp(request->technique, excluded))
        ok = pen_fail(r->error, PEN_INVALID, "/technique",
            "%s stands for another method, by what renders took so far: a sequence needs one that "
            "is the same in all frames.",
            excluded);
    pen_params_default(pen_sequence_table(), &r->sequence->options);
    pen_params_default(pen_turntable_table(), &r->sequence->turntable);
    ok = ok && (!node || read_sequence(r, node)) && count_frames(r) && check_frames(r);
    cJSON_Delete(node);
    return ok;
}

struct pen_sequence *pen_sequence_from_json(const char *text, size_t bytes,
    const struct pen_catalogue *catalogue, const char *excluded, bool with_scene,
    struct pen_error *error)
{
    if (bytes > PEN_MAX_JSON_BYTES)
        pen_fail(
            error, PEN_TOO_BIG, "", "A request may have at most %d bytes.", PEN_MAX_JSON_BYTES);
    if (bytes > PEN_MAX_JSON_BYTES || !pen_json_scan(text, bytes, PEN_MAX_JSON_DEPTH, error))
        return NULL;
    struct pen_sequence *sequence = pen_alloc_zero(1, sizeof *sequence);
    struct reader reader = {catalogue, sequence, error};
    cJSON *root = cJSON_ParseWithLength(text, bytes);
    bool ok = root ? read_root(&reader, root, excluded, with_scene)
                   : pen_fail(error, PEN_MALFORMED, "", "Malformed JSON.");
    cJSON_Delete(root);
    if (ok)
        return sequence;
    pen_sequence_destroy(sequence);
    return NULL;
}

void pen_sequence_destroy(struct pen_sequence *s)
{
    if (!s)
        return;
    free(s->views);
    free(s->keys);
    free(s);
}

/* ---- frames ---- */

/* The keyframes around a frame that a curve there depends on. */
struct around {
    uint32_t count, last; /* last: the one at or before the frame */
    const struct pen_keyframe *keys[4];
};

/* Those that have lights, or a camera. */
static struct around find_around(const struct pen_sequence *s, bool lights, uint32_t frame)
{
    struct around around = {0};
    uint32_t behind = 0;
    for (uint32_t k = 0; k < s->key_count && behind < 2; k++) {
        const struct pen_keyframe *key = &s->keys[k];
        if (!(lights ? key->has_lights : key->has_camera))
            continue;
        behind += key->frame > frame && around.count;
        if (around.count == 2 && key->frame <= frame) {
            around.keys[0] = around.keys[1];
            around.count = 1;
        }
        around.keys[around.count++] = key;
        around.last = key->frame <= frame ? around.count - 1 : around.last;
    }
    return around;
}

/* One row of what the keyframes have at `offset`. */
static void blend_row(const struct around *around, const struct pen_param *row, size_t offset,
    bool cubic, double x, void *object)
{
    double places[4], values[4], result[4];
    uint32_t last = around->last, next = last + 1 < around->count ? last + 1 : last;
    for (uint32_t i = 0; i < row->count; i++) {
        double least = row->min, most = row->max;
        for (uint32_t k = 0; k < around->count; k++) {
            places[k] = around->keys[k]->frame;
            values[k] = pen_param_load(row, (const char *)around->keys[k] + offset, i);
        }
        if (row->min >= 0) {
            least = fmin(values[last], values[next]);
            most = fmax(values[last], values[next]);
        }
        result[i] =
            fmin(fmax(pen_keyframes_at(places, values, around->count, cubic, x), least), most);
    }
    pen_param_store(row, object, result, "", NULL);
}

static void blend(const struct pen_sequence *s, const struct around *around,
    struct pen_param_table table, size_t offset, double x, void *object)
{
    for (uint32_t i = 0; i < table.count; i++)
        if (goes_between(&table.rows[i], object))
            blend_row(
                around, &table.rows[i], offset, s->options.interpolation == PEN_CUBIC, x, object);
}

bool pen_sequence_moves_lights(const struct pen_sequence *s)
{
    return find_around(s, true, 0).count > 0;
}

static void turn(const struct pen_sequence *s, uint32_t frame, struct pen_camera *camera)
{
    const struct pen_turntable *table = &s->turntable;
    double angle = table->azimuth_deg + 360.0 * table->turns * frame / s->options.frames;
    camera->mode = PEN_CAMERA_ORBIT;
    camera->azimuth_deg = (float)remainder(angle, 360);
    camera->elevation_deg = table->elevation_deg;
    camera->distance = table->distance;
}

void pen_sequence_frame(const struct pen_sequence *s, uint32_t frame, struct pen_request *request)
{
    const struct around camera = find_around(s, false, frame), lights = find_around(s, true, frame);
    *request = s->request;
    if (s->turns)
        turn(s, frame, &request->camera);
    if (s->view_count)
        request->camera = s->views[frame];
    if (camera.count) {
        request->camera = camera.keys[0]->camera;
        blend(s, &camera, pen_camera_table(), offsetof(struct pen_keyframe, camera), frame,
            &request->camera);
    }
    if (lights.count) {
        const struct pen_keyframe *key = lights.keys[0];
        request->lights_given = 1;
        request->light_count = key->light_count;
        memcpy(request->lights, key->lights, sizeof request->lights);
        for (uint32_t i = 0; i < key->light_count; i++)
            blend(s, &lights, pen_light_table(),
                offsetof(struct pen_keyframe, lights) + i * sizeof(struct pen_light), frame,
                &request->lights[i]);
    }
    if (*request->animation)
        request->time_s = fminf(request->time_s + (float)frame / s->options.fps, 1e6f);
}
