#include "protocol/json_result.h"
#include <stdio.h>

/* Milliseconds to the microsecond: more digits than any timer here has are noise. */
static void write_ms(struct pen_json *json, const char *key, double ms)
{
    char text[32];
    snprintf(text, sizeof text, "%.3f", ms);
    pen_json_raw(json, key, ms >= 0 && ms < 1e12 ? text : "null");
}

static uint32_t least(uint32_t a, uint32_t b)
{
    return a < b ? a : b;
}

void pen_result_write_device(
    struct pen_json *json, const char *key, const struct pen_device_info *device)
{
    pen_json_object(json, key);
    pen_json_string(json, "renderer", device->renderer);
    pen_json_string(json, "version", device->version);
    pen_json_string(json, "platform", device->platform);
    pen_json_bool(json, "software", device->software);
    pen_json_end(json);
}

void pen_result_write_times(struct pen_json *json, const struct pen_result *result)
{
    pen_json_object(json, "stages_ms");
    for (uint32_t s = 0; s < PEN_STAGES; s++)
        write_ms(json, pen_stage_names[s], result->stage_ms[s]);
    pen_json_end(json);
    pen_json_array(json, "passes");
    for (uint32_t p = 0; p < least(result->pass_count, PEN_MAX_PASSES); p++) {
        const struct pen_pass_time *pass = &result->passes[p];
        pen_json_object(json, NULL);
        pen_json_string(json, "name", pass->name);
        pen_json_string(
            json, "stage", pass->stage < PEN_STAGES ? pen_stage_names[pass->stage] : NULL);
        pen_json_uint(json, "count", pass->count);
        write_ms(json, "ms", pass->ms);
        pen_json_end(json);
    }
    pen_json_end(json);
}

static void write_progress(struct pen_json *json, const struct pen_progress *progress)
{
    pen_json_object(json, "progress");
    pen_json_uint(json, "picture", progress->number);
    pen_json_uint(json, "samples", progress->done);
    pen_json_uint(json, "of", progress->total);
    pen_json_uint(json, "taken_over", progress->kept);
    if (progress->standard_error >= 0)
        pen_json_float(json, "standard_error", progress->standard_error);
    else
        pen_json_null(json, "standard_error");
    write_ms(json, "elapsed_ms", (double)progress->elapsed_ms);
    pen_json_end(json);
}

char *pen_result_json(const struct pen_result *result, const struct pen_record_extra *extra,
    const struct pen_catalogue *catalogue)
{
    static const struct pen_record_extra nothing;
    static const char *const class_names[] = {"lit", "penumbra", "umbra"};
    const struct pen_request *completed = &result->completed;
    struct pen_json json = {0};
    if (!extra)
        extra = &nothing;
    pen_json_object(&json, NULL);
    if (extra->request_id)
        pen_json_string(&json, "request_id", extra->request_id);
    pen_json_id(&json, "scene", completed->scene);
    pen_request_write(&json, "request", completed, catalogue);
    pen_json_object(&json, "image");
    if (extra->image_href)
        pen_json_link(&json, "href", extra->image_href);
    if (extra->etag)
        pen_json_string(&json, "etag", extra->etag);
    pen_json_string(&json, "type", pen_format_mime[completed->output.format]);
    pen_json_uint(&json, "width", completed->width);
    pen_json_uint(&json, "height", completed->height);
    pen_json_uint(&json, "bytes", result->image_bytes);
    pen_json_end(&json);
    pen_json_array(&json, "warnings");
    for (uint32_t w = 0; w < least(result->warning_count, PEN_MAX_WARNINGS); w++)
        pen_json_string(&json, NULL, result->warnings[w]);
    if (extra->choice && !extra->choice_met)
        pen_json_string(&json, NULL, extra->choice);
    pen_json_end(&json);
    if (extra->choice)
        pen_json_string(&json, "choice", extra->choice);
    pen_result_write_device(&json, "device", &result->device);
    pen_json_object(&json, "cache");
    pen_json_bool(&json, "result", extra->from_cache);
    pen_json_bool(&json, "scene_resident", result->scene_was_resident);
    pen_json_bool(&json, "shadow_inputs_reused", result->shadow_inputs_reused);
    pen_json_end(&json);
    write_ms(&json, "total_ms", extra->total_ms);
    pen_result_write_times(&json, result);
    pen_json_object(&json, "pixels");
    for (int c = 0; c < 3; c++)
        pen_json_uint(&json, class_names[c], result->class_pixels[c]);
    pen_json_uint(&json, "full_work", result->full_work_pixels);
    pen_json_array(&json, "subdivided");
    for (int level = 0; level < 2; level++)
        pen_json_uint(&json, NULL, result->subdivided_pixels[level]);
    pen_json_end(&json);
    pen_json_end(&json);
    if (pen_request_is_stateful(completed, catalogue)) {
        pen_json_object(&json, "history");
        pen_json_string(&json, "session", completed->delivery.session);
        pen_json_uint(&json, "frames", result->history_frames);
        pen_json_double(&json, "share", (double)result->history_share);
        pen_json_end(&json);
    }
    pen_json_uint(&json, "triangles_drawn", result->triangles_drawn);
    pen_json_uint(&json, "rays", result->rays);
    pen_json_uint(&json, "shadow_maps", result->shadow_maps);
    write_progress(&json, &result->progress);
    pen_json_object(&json, "renderer");
    write_ms(&json, "used_ms", result->turns_ms);
    if (result->estimate_ms >= 0)
        write_ms(&json, "expected_ms", result->estimate_ms);
    else
        pen_json_null(&json, "expected_ms");
    pen_json_end(&json);
    pen_json_uint(&json, "gpu_bytes", result->gpu_bytes);
    pen_json_end(&json);
    return pen_json_finish(&json, NULL);
}

void pen_server_timing(const struct pen_result *result, double total_ms, char *text, size_t bytes)
{
    size_t at = 0;
    text[0] = 0;
    for (uint32_t s = 0; s <= PEN_STAGES && at < bytes; s++) {
        bool total = s == PEN_STAGES;
        int wrote = snprintf(text + at, bytes - at, "%s%s;dur=%.3f", s ? ", " : "",
            total ? "total" : pen_stage_names[s], total ? total_ms : (double)result->stage_ms[s]);
        if (wrote < 0 || at + (size_t)wrote >= bytes) {
            text[at] = 0; /* half an entry is worse than none */
            return;
        }
        at += (size_t)wrote;
    }
}

char *pen_problem_json(const struct pen_error *error, uint32_t status, const char *title,
    bool retryable, const char *request_id)
{
    struct pen_json json = {0};
    pen_json_object(&json, NULL);
    /* The status says what kind of problem it is, which is what about:blank stands for. */
    pen_json_string(&json, "type", "about:blank");
    pen_json_string(&json, "title", title);
    pen_json_uint(&json, "status", status);
    pen_json_string(&json, "detail", error->message);
    if (error->pointer[0])
        pen_json_string(&json, "pointer", error->pointer);
    pen_json_bool(&json, "retryable", retryable);
    if (request_id)
        pen_json_string(&json, "request_id", request_id);
    pen_json_end(&json);
    return pen_json_finish(&json, NULL);
}
