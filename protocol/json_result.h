/* Documents that the service sends. Every function returns NUL-terminated JSON that the caller
 * frees; the `_write` forms add the same to a document that is being written. */
#pragma once
#include "protocol/json_writer.h"
#include "protocol/result.h"
#include "protocol/scene_info.h"
#include "protocol/technique_info.h"

/* A request in the form that pen_request_from_json reads, with every value written out. What does
 * not apply (a sun's width, the eye of an orbit camera) is left out. */
void pen_request_write(struct pen_json *json, const char *key, const struct pen_request *request,
    const struct pen_catalogue *catalogue);
char *pen_request_json(const struct pen_request *request, const struct pen_catalogue *catalogue);

/* One light, and one row table, in the same form. */
void pen_light_write(struct pen_json *json, const char *key, const struct pen_light *light);

/* What the front end knows about an answer and the worker does not; every field may be 0. */
struct pen_record_extra {
    const char *request_id;
    const char *image_href; /* where the image can be fetched */
    const char *etag;
    double total_ms;    /* from the last byte of the request to the record */
    bool from_cache;    /* the image was not rendered for this request */
    const char *choice; /* why this method was taken, when the request left that open */
    bool choice_met;    /* false: nothing meets what was asked */
};

/* The full record of a render: the request as completed, warnings, device, cache hits, times per
 * stage and per pass, counts. `extra` may be NULL. */
char *pen_result_json(const struct pen_result *result, const struct pen_record_extra *extra,
    const struct pen_catalogue *catalogue);

/* Parts of it: the device, and "stages_ms" with "passes". */
void pen_result_write_device(
    struct pen_json *json, const char *key, const struct pen_device_info *device);
void pen_result_write_times(struct pen_json *json, const struct pen_result *result);

/* The Server-Timing header's value, "queue;dur=0.1, load;dur=0, ..."; at most `bytes`
 * with the NUL. */
void pen_server_timing(const struct pen_result *result, double total_ms, char *text, size_t bytes);

/* application/problem+json (RFC 9457), for the status that the error is told with. `request_id` may
 * be NULL. */
char *pen_problem_json(const struct pen_error *error, uint32_t status, const char *title,
    bool retryable, const char *request_id);

void pen_technique_write(
    struct pen_json *json, const char *key, const struct pen_technique_info *info);
char *pen_technique_json(const struct pen_technique_info *info);
/* {"techniques": [...]} */
char *pen_techniques_json(const struct pen_catalogue *catalogue);

void pen_scene_write(struct pen_json *json, const char *key, const struct pen_scene_info *scene);
char *pen_scene_json(const struct pen_scene_info *scene);
void pen_image_write(struct pen_json *json, const char *key, const struct pen_image_info *image);
char *pen_image_json(const struct pen_image_info *image);
