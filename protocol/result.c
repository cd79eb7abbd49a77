#include "protocol/result.h"
#include <stdarg.h>
#include <stdio.h>

const char *const pen_stage_names[] = {
    "queue", "load", "gbuffer", "shadow", "technique", "shade", "readback", "encode", NULL};

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
