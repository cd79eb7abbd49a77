/* Sequences: many views of one scene, from one request. */
#pragma once
#include "protocol/request.h"
#include "protocol/technique_info.h"
#include <stddef.h>

#define PEN_SEQUENCE_FRAMES 10000
#define PEN_SEQUENCE_KEYS 256

enum pen_interpolation { PEN_LINEAR, PEN_CUBIC };
enum pen_archive { PEN_ARCHIVE_ZIP, PEN_ARCHIVE_WEBP, PEN_ARCHIVE_NONE };
extern const char *const pen_interpolation_names[], *const pen_archive_names[];

struct pen_sequence_options {
    uint32_t frames;
    float fps;
    uint32_t interpolation; /* enum pen_interpolation */
    uint32_t archive;       /* enum pen_archive */
};
struct pen_turntable {
    float turns, azimuth_deg, elevation_deg;
    double distance; /* m; 0: frames the bounds */
};
struct pen_param_table pen_sequence_table(void);  /* base: struct pen_sequence_options */
struct pen_param_table pen_turntable_table(void); /* base: struct pen_turntable */

struct pen_keyframe {
    uint32_t frame;
    bool has_camera, has_lights;
    struct pen_camera camera;
    uint32_t light_count;
    struct pen_light lights[PEN_MAX_LIGHTS];
};

struct pen_sequence {
    struct pen_request request; /* what all frames have in common */
    struct pen_sequence_options options;
    bool turns; /* it is a turntable */
    struct pen_turntable turntable;
    uint32_t view_count;
    struct pen_camera *views;
    uint32_t key_count;
    struct pen_keyframe *keys;
};

/* Reads the body of a sequence: a render request with "sequence", an object of pen_sequence_table's
 * rows and at most one of
 *   "turntable"  an object of pen_turntable_table's rows
 *   "views"      a list of cameras
 *   "keyframes"  a list of {"frame", "camera", "lights"}, each with one of the two at least
 * and, with_scene, "scene", the scene's id. Without any of the three the camera stands still. With
 * "animation" each frame is 1 / fps later than the one before. Every frame is checked. Errors as
 * pen_request_from_json; a request for the method `excluded` (NULL: none) is PEN_INVALID. Ends with
 * pen_sequence_destroy; NULL: failed. */
struct pen_sequence *pen_sequence_from_json(const char *text, size_t bytes,
    const struct pen_catalogue *catalogue, const char *excluded, bool with_scene,
    struct pen_error *error);
void pen_sequence_destroy(struct pen_sequence *sequence); /* NULL is fine */
/* The request for one frame, from 0. */
void pen_sequence_frame(
    const struct pen_sequence *sequence, uint32_t frame, struct pen_request *request);
/* The lights move: what is measured of them must be measured once. */
bool pen_sequence_moves_lights(const struct pen_sequence *sequence);
