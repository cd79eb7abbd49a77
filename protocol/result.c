#include "protocol/result.h"
#include <stdarg.h>
#include <stdio.h>

const char *const pen_stage_names[] = {
    "queue", "load", "gbuffer", "shadow", "technique", "shade", "readback", "encode", NULL};

void pen_device_receive(struct pen_device_info *device)
{
    device->renderer[sizeof device->renderer - 1] = 0;
    device->version[sizeof device->version - 1] = 0;
    device->platform[sizeof device->platform - 1] = 0;
}

bool pen_result_receive(struct pen_result *r, const struct pen_catalogue *catalogue)
{
    pen_error_receive(&r->error);
    if (!pen_request_is_legible(&r->completed, catalogue) || r->warning_count > PEN_MAX_WARNINGS ||
        r->pass_count > PEN_MAX_PASSES)
        return false;
    pen_device_receive(&r->device);
    for (uint32_t i = 0; i < r->warning_count; i++)
        r->warnings[i][sizeof r->warnings[i] - 1] = 0;
    for (uint32_t i = 0; i < r->pass_count; i++) {
        struct pen_pass_time *pass = &r->passes[i];
        pass->name[sizeof pass->name - 1] = 0;
        if (pass->stage >= PEN_STAGES)
            return false;
    }
    return true;
}

void pen_result_warn(struct pen_result *result, const char *format, ...)
{
    if (result->warning_count == PEN_MAX_WARNINGS)
        return;
    char *at = result->warnings[result->warning_count++];
    va_list args;
    va_start(args, format);
    vsnprintf(at, sizeof result->warnings[0], format, args);
    va_end(args);
}
