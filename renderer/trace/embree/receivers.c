/* Receivers, from arrays or from a camera's depths. */
#include "renderer/trace/embree/packet.h"
#include <math.h>

void trace_normal_decode(const uint16_t e[2], float n[3])
{
    float x = (float)e[0] * (2.0f / 65535) - 1, y = (float)e[1] * (2.0f / 65535) - 1;
    float z = 1 - fabsf(x) - fabsf(y), fold = z < 0 ? -z : 0;
    n[0] = x + (x >= 0 ? -fold : fold);
    n[1] = y + (y >= 0 ? -fold : fold);
    n[2] = z;
}

bool pen_trace_view_read(const struct pen_trace_view *view, const float eye[3], uint32_t width,
    uint32_t pixel, float position[3], float normal[3])
{
    float depth = view->depths[pixel], scale = 1 / depth;
    float x = (float)(pixel % width), y = (float)(pixel / width);
    if (!(depth > 0))
        return false;
    for (int c = 0; c < 3; c++)
        position[c] = eye[c] + (view->first[c] + x * view->right[c] + y * view->down[c]) * scale;
    trace_normal_decode(view->normals + 4 * (size_t)pixel, normal);
    return true;
}

static bool read(const struct pen_trace_job *job, uint32_t pixel, float p[3], float n[3])
{
    if (job->view)
        return pen_trace_view_read(job->view, job->eye, job->width, pixel, p, n);
    uint32_t position_stride = job->position_stride ? job->position_stride : 3;
    uint32_t normal_stride = job->normal_stride ? job->normal_stride : 3;
    for (uint32_t c = 0; c < 3; c++) {
        p[c] = job->positions[(size_t)pixel * position_stride + c];
        n[c] = job->normals[(size_t)pixel * normal_stride + c];
    }
    return true;
}

bool trace_receiver_read(
    const struct pen_trace_job *job, float extent, uint32_t pixel, struct trace_receiver *out)
{
    float p[3], n[3], to[3];
    if (!read(job, pixel, p, n))
        return false;
    float length = sqrtf(trace_dot(n, n));
    if (!(length > 0) || !isfinite(length + p[0] + p[1] + p[2]))
        return false;
    float largest = fmaxf(fmaxf(fabsf(p[0]), fabsf(p[1])), fabsf(p[2]));
    for (int c = 0; c < 3; c++)
        to[c] = job->eye[c] - p[c];
    float distance = sqrtf(trace_dot(to, to)), rounding, pull;
    float cosine = fmaxf(fabsf(trace_dot(n, to)) / (length * fmaxf(distance, 1e-30f)), 0.1f);
    rounding = 0x1p-18f * fmaxf(largest, 0.25f * extent);
    out->bias = fmaxf(job->bias, rounding);
    pull = fminf(fmaxf(job->depth_error, job->aim_error / cosine), 0.5f);
    for (int c = 0; c < 3; c++) {
        out->position[c] = p[c] + pull * to[c];
        out->normal[c] = n[c] / length;
    }
    out->pixel = pixel;
    return true;
}

/* horizon.glsl has the same, and says why. */
float pen_trace_horizon_share(float middle, float across, float along, bool round)
{
    const float pi = 3.14159265f;
    if (round) {
        float u = middle / fmaxf(hypotf(across, along), 1e-20f);
        u = fminf(fmaxf(u, -1), 1);
        return 0.5f + (u * sqrtf(fmaxf(1 - u * u, 0)) + asinf(u)) / pi;
    }
    across = fabsf(across);
    along = fabsf(along);
    float a = fmaxf(across, along), b = fmaxf(fminf(across, along), 1e-4f * a), f[2];
    if (fabsf(middle) >= a + b)
        return middle > 0 ? 1 : 0;
    for (int k = 0; k < 2; k++) {
        float x = k ? middle - b : middle + b, t = fminf(fmaxf(x, -a), a);
        f[k] = 0.5f * (t + a) * (t + a) + 2 * a * fmaxf(x - a, 0);
    }
    return fminf(fmaxf((f[0] - f[1]) / (4 * a * b), 0), 1);
}
