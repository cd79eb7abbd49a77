/* What both ways of tracing share. */
#include "renderer/passes/rays/rays.h"
#include "renderer/passes/draw/screen.h"
#include <math.h>
#include <string.h>

void ray_targets_finish(struct ray_targets *t)
{
    struct gl_target *targets[] = {&t->visibility, &t->standard_error, &t->receivers[0],
        &t->receivers[1], &t->verdicts, &t->spread};
    for (size_t i = 0; i < sizeof targets / sizeof *targets; i++)
        gl_target_destroy(targets[i]);
    GLuint buffers[] = {t->points, t->state, t->list, t->counters, t->job};
    gl.DeleteBuffers(sizeof buffers / sizeof *buffers, buffers);
    gl.DeleteFramebuffers(1, &t->receivers_framebuffer);
    *t = (struct ray_targets){0};
}

struct pen_trace_light ray_light(const struct technique_run *run)
{
    static const uint32_t types[PEN_LIGHT_TYPES] = {[PEN_LIGHT_RECT] = PEN_TRACE_RECT,
        [PEN_LIGHT_DISK] = PEN_TRACE_DISK,
        [PEN_LIGHT_SPHERE] = PEN_TRACE_SPHERE,
        [PEN_LIGHT_SUN] = PEN_TRACE_SUN,
        [PEN_LIGHT_POINT] = PEN_TRACE_POINT,
        [PEN_LIGHT_SPOT] = PEN_TRACE_POINT};
    const struct light *light = run->light;
    struct pen_trace_light t = {.type = types[light->source->type], .cos_cone = -1};
    if (light->source->type == PEN_LIGHT_SPOT)
        t.cos_cone = 0; /* nothing behind its plane is lit; shading knows its cone */
    memcpy(t.origin, light->origin, sizeof t.origin);
    memcpy(t.x, light->x, sizeof t.x);
    memcpy(t.y, light->y, sizeof t.y);
    memcpy(t.z, light->z, sizeof t.z);
    memcpy(t.half, light->faces[0].extent, sizeof t.half);
    return t;
}

float ray_aim_error(const struct technique_run *run)
{
    return RAY_AIM_ERROR * 2 * tanf(0.5f * run->view->fov_y_rad) / (float)run->height;
}

bool ray_receivers(struct technique_run *run, struct ray_targets *t, struct pen_error *error)
{
    bool made = gl_target_fit(&t->receivers[0], GL_RGBA32F, run->width, run->height, 0, 1);
    made |= gl_target_fit(&t->receivers[1], GL_RGBA32F, run->width, run->height, 0, 1);
    if (made || !t->receivers_framebuffer) {
        gl.DeleteFramebuffers(1, &t->receivers_framebuffer);
        const struct gl_texture *colors[] = {&t->receivers[0].texture, &t->receivers[1].texture};
        t->receivers_framebuffer = gl_framebuffer_create(colors, 2, NULL);
    }
    struct pass_texture textures[] = {
        {UNIT_DEPTH, run->gbuffer->depth.texture.name, GL_SAMPLE_NEAREST},
        {UNIT_NORMAL, run->gbuffer->normal.texture.name, GL_SAMPLE_NEAREST}};
    return pass_fill(run->ctx,
        &(struct pass_fill){.name = "receivers",
            .fragment = "receivers.frag",
            .stage = PEN_STAGE_TECHNIQUE,
            .textures = textures,
            .texture_count = 2,
            .framebuffer = t->receivers_framebuffer,
            .width = run->width,
            .height = run->height},
        error);
}
