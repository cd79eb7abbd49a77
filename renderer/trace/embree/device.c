#include "renderer/trace/embree/internal.h"

bool trace_check_device(struct pen_trace_scene *scene, struct pen_error *error)
{
    enum RTCError code = rtcGetDeviceError(scene->device);
    if (atomic_load(&scene->over_budget))
        return pen_fail(error, PEN_TOO_BIG, "/scene",
            "The scene needs more than %llu MiB to be ray traced.",
            (unsigned long long)(scene->max_bytes >> 20));
    if (code == RTC_ERROR_NONE)
        return true;
    return pen_fail(error, PEN_INTERNAL, "", "Embree failed with code %d.", (int)code);
}
