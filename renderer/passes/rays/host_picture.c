#include "renderer/passes/rays/host_picture.h"
#include "protocol/memory.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Pixel (x, y) at the distance d shows eye + d (forward + sx right + sy up), and clip space has
 * x = sx f / aspect + kx, y = sy f + ky of it: the shears kx and ky move the pixel grid. */
static void make_rays(const struct technique_run *run, struct pen_trace_view *rays)
{
    const struct view *v = run->view;
    double t = tan(0.5 * (double)v->fov_y_rad), kx = 0, ky = 0;
    for (int c = 0; c < 3; c++) {
        kx += (double)v->world_to_clip[c][0] * (double)v->forward[c];
        ky += (double)v->world_to_clip[c][1] * (double)v->forward[c];
    }
    double tx = t * (double)v->aspect, step_x = 2 * tx / run->width, step_y = 2 * t / run->height;
    double sx = 0.5 * step_x - tx * (1 + kx), sy = t * (1 - ky) - 0.5 * step_y;
    for (int c = 0; c < 3; c++) {
        double right = (double)v->right[c], up = (double)v->up[c], near_z = (double)v->near_z;
        rays->first[c] = (float)(near_z * ((double)v->forward[c] + sx * right + sy * up));
        rays->right[c] = (float)(near_z * step_x * right);
        rays->down[c] = (float)(-near_z * step_y * up);
    }
}

void host_picture_read(const struct technique_run *run, struct host_picture *p)
{
    size_t count = (size_t)run->width * run->height;
    p->depths = pen_alloc(count, sizeof *p->depths);
    p->normals = pen_alloc(count, 4 * sizeof *p->normals);
    gl.PixelStorei(GL_PACK_ALIGNMENT, 1);
    gl.GetTextureImage(run->gbuffer->depth.texture.name, 0, GL_DEPTH_COMPONENT, GL_FLOAT,
        (GLsizei)(count * sizeof *p->depths), p->depths);
    gl.GetTextureImage(run->gbuffer->normal.texture.name, 0, GL_RGBA, GL_UNSIGNED_SHORT,
        (GLsizei)(count * 4 * sizeof *p->normals), p->normals);
    p->view = (struct pen_trace_view){.depths = p->depths, .normals = p->normals};
    make_rays(run, &p->view);
}

void host_picture_finish(struct host_picture *p)
{
    free(p->depths);
    free(p->normals);
}

void host_picture_write(const struct technique_run *run, const uint16_t *halves)
{
    gl.PixelStorei(GL_UNPACK_ALIGNMENT, 2);
    gl.TextureSubImage3D(run->vis->name, 0, 0, 0, (GLint)run->light_index, (GLsizei)run->width,
        (GLsizei)run->height, 1, GL_RGBA, GL_HALF_FLOAT, halves);
}

/* What raytraced.glsl and screen.frag make of a visibility. */
static void settle_pixel(const struct technique_run *run, const struct host_picture *picture,
    uint32_t pixel, bool horizon, float v[4])
{
    const struct light_face *face = run->face;
    const vec4 *to_light = face->world_to_light;
    float world[3], normal[3], p[3], n[3] = {0};
    bool known = v[3] >= 1 || (v[3] <= 0 && !face->omni);
    if (known ||
        !pen_trace_view_read(&picture->view, run->view->eye, run->width, pixel, world, normal))
        return;
    for (int c = 0; c < 3; c++) {
        p[c] = to_light[3][c];
        for (int i = 0; i < 3; i++) {
            p[c] += to_light[i][c] * world[i];
            n[c] += to_light[i][c] * normal[i];
        }
    }
    float middle = face->parallel ? -n[2] : -(n[0] * p[0] + n[1] * p[1] + n[2] * p[2]), share = 1;
    bool behind = face->omni && p[2] <= face->near_z;
    if (horizon)
        share = pen_trace_horizon_share(
            middle, n[0] * face->extent[0], n[1] * face->extent[1], face->shape == SHAPE_DISK);
    for (int c = 0; c < 4; c++)
        v[c] = behind ? face->emission_mean[c] : v[c] / fmaxf(share, 0.25f);
    v[3] = behind ? 1 : v[3];
}

void host_picture_settle(const struct technique_run *run, const struct host_picture *picture,
    bool horizon, const float *visibility)
{
    uint32_t count = run->width * run->height;
    uint16_t *halves = pen_alloc(count, 4 * sizeof *halves);
    for (uint32_t pixel = 0; pixel < count; pixel++) {
        float v[4];
        memcpy(v, visibility + 4 * (size_t)pixel, sizeof v);
        settle_pixel(run, picture, pixel, horizon, v);
        for (int c = 0; c < 4; c++)
            halves[4 * (size_t)pixel + (size_t)c] = pen_trace_half(fminf(fmaxf(v[c], 0), 1));
    }
    host_picture_write(run, halves);
    free(halves);
}
