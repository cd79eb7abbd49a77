#include "renderer/scene/view.h"
#include "protocol/memory.h"
#include <cglm/cglm.h>
#include <stdlib.h>
#include <string.h>

static void make_matrices(struct view *v, float jitter_x, float jitter_y)
{
    float f = 1 / tanf(0.5f * v->fov_y_rad);
    mat4 world_to_view = {{v->right[0], v->up[0], -v->forward[0], 0},
        {v->right[1], v->up[1], -v->forward[1], 0}, {v->right[2], v->up[2], -v->forward[2], 0},
        {-glm_vec3_dot(v->right, v->eye), -glm_vec3_dot(v->up, v->eye),
            glm_vec3_dot(v->forward, v->eye), 1}};
    /* Reversed infinite depth keeps precision far away; with GL_UPPER_LEFT clip control +y is up
     * and row 0 of the image is the top. A pixel shift is a shear along the view axis. */
    mat4 view_to_clip = {{f / v->aspect, 0, 0, 0}, {0, f, 0, 0},
        {-2 * jitter_x / (float)v->width, 2 * jitter_y / (float)v->height, 0, -1},
        {0, 0, v->near_z, 0}};
    glm_mat4_mul(view_to_clip, world_to_view, v->world_to_clip);
    glm_mat4_inv_precise(v->world_to_clip, v->clip_to_world);
}

/* Share of the picture's half that the subject may fill: the rest is air around it. */
#define FILL 0.9f

#define LEAST_NEAR 1e-3f /* of the usual near plane, or it would be at the eye */

#define TURNS 48 /* azimuths that an orbit is framed for */

/* The content's extremes relative to its centre: x to the right, y up, z towards the eye. */
struct framing {
    float (*points)[3];
    uint32_t count;
};

/* The least distance at which all points are inside a picture of half width t at distance 1, however
 * the view is moved along `axis`: |x - move| <= t (distance - z) holds for both sides with the
 * smallest distance where the largest z + x / t and the largest z - x / t are equal. */
static float framing_distance(const struct framing *f, int axis, float t)
{
    float right = -INFINITY, left = -INFINITY;
    for (uint32_t i = 0; i < f->count; i++) {
        right = fmaxf(right, f->points[i][2] + f->points[i][axis] / t);
        left = fmaxf(left, f->points[i][2] - f->points[i][axis] / t);
    }
    return 0.5f * (right + left);
}

/* The move that leaves the same margin on both sides at that distance: the sum of the two outermost
 * tangents falls with it. */
static float framing_move(const struct framing *f, int axis, float distance)
{
    float low = INFINITY, high = -INFINITY;
    for (uint32_t i = 0; i < f->count; i++) {
        low = fminf(low, f->points[i][axis]);
        high = fmaxf(high, f->points[i][axis]);
    }
    for (int step = 0; step < 30; step++) {
        float move = 0.5f * (low + high), most = -INFINITY, least = INFINITY;
        for (uint32_t i = 0; i < f->count; i++) {
            float tangent = (f->points[i][axis] - move) / (distance - f->points[i][2]);
            most = fmaxf(most, tangent);
            least = fminf(least, tangent);
        }
        if (most + least > 0)
            low = move;
        else
            high = move;
    }
    return 0.5f * (low + high);
}

/* `all_round`: for any azimuth, so that an orbit neither jumps nor breathes. */
static struct framing collect(
    const struct scene *scene, const float center[3], const float axes[3][3], bool all_round)
{
    const uint32_t turns = all_round ? TURNS : 1;
    struct framing f = {.count = scene->stage->outline.extreme_count * turns};
    f.points = pen_alloc_zero(f.count, sizeof *f.points);
    for (uint32_t n = 0; n < f.count; n++) {
        const float *from = scene->stage->outline.extremes[n / turns];
        float angle = 2 * GLM_PIf * (float)(n % turns) / (float)turns;
        float x = from[0] - center[0], z = from[2] - center[2];
        float p[3] = {x * cosf(angle) + z * sinf(angle), from[1] - center[1],
            z * cosf(angle) - x * sinf(angle)};
        for (int k = 0; k < 3; k++)
            f.points[n][k] = p[0] * axes[k][0] + p[1] * axes[k][1] + p[2] * axes[k][2];
    }
    return f;
}

/* How much of the content's surface shows its front to a view from there. */
static float shown_from(const struct scene *scene, float azimuth, float elevation)
{
    const float to[3] = {
        sinf(azimuth) * cosf(elevation), sinf(elevation), cosf(azimuth) * cosf(elevation)};
    float sum = 0;
    for (uint32_t i = 0; scene->stage->moment_count && i < scene->stage->moments[0].samples.count;
         i++) {
        float facing =
            glm_vec3_dot((float *)scene->stage->moments[0].samples.at[i].normal, (float *)to);
        bool one_sided = scene->stage->moments[0].samples.at[i].one_sided;
        sum += one_sided ? fmaxf(facing, 0) : fabsf(facing);
    }
    return sum;
}

#define LEAST_SHOWN 0.3f /* of what another side shows, or that one is taken */

/* Of something that is seen from one side only, the side it is seen from; from below only where no side
 * above shows it. */
static void turn_to_front(struct pen_camera *c, const struct scene *scene)
{
    float elevation = glm_rad(c->elevation_deg), usual = c->azimuth_deg, most = 0, best = usual;
    float shown = shown_from(scene, glm_rad(usual), elevation);
    for (int turn = 180; turn >= -90; turn -= 90) { /* the back first */
        float there = shown_from(scene, glm_rad(usual + (float)turn), elevation);
        if (there > 1.01f * most)
            most = there, best = usual + (float)turn;
    }
    if (fmaxf(shown, most) < LEAST_SHOWN * shown_from(scene, glm_rad(usual), -elevation))
        c->elevation_deg = -c->elevation_deg;
    else if (shown < LEAST_SHOWN * most)
        c->azimuth_deg = best;
}

static void frame_content(struct pen_camera *c, const struct scene *scene, float aspect)
{
    float center[3], eye[3], target[3], distance = (float)c->distance, move[2] = {0, 0};
    scene_center(scene, center);
    float azimuth = glm_rad(c->azimuth_deg), elevation = glm_rad(c->elevation_deg);
    float tan_y = FILL * tanf(0.5f * glm_rad(c->fov_y_deg));
    float axes[3][3] = {{cosf(azimuth), 0, -sinf(azimuth)},
        {-sinf(azimuth) * sinf(elevation), cosf(elevation), -cosf(azimuth) * sinf(elevation)},
        {sinf(azimuth) * cosf(elevation), sinf(elevation), cosf(azimuth) * cosf(elevation)}};
    if (distance <= 0 && scene->stage->outline.extreme_count) {
        struct framing f =
            collect(scene, center, (const float(*)[3])axes, c->mode == PEN_CAMERA_ORBIT);
        distance = fmaxf(framing_distance(&f, 0, tan_y * aspect), framing_distance(&f, 1, tan_y));
        for (int k = 0; k < 2; k++)
            move[k] = framing_move(&f, k, distance);
        free(f.points);
    }
    if (!(distance > 0))
        distance = 3 * scene_radius(scene);
    for (int i = 0; i < 3; i++) {
        target[i] = center[i] + move[0] * axes[0][i] + move[1] * axes[1][i];
        eye[i] = target[i] + distance * axes[2][i];
    }
    scene_point_out(scene, target, c->target);
    scene_point_out(scene, eye, c->eye);
    c->up[0] = 0, c->up[1] = 1, c->up[2] = 0;
}

/* Depth is reversed and infinite: a small near plane costs precision only where triangles come as near.
 * Nothing is cut off: in a wide scene a camera may look at something small. As a power of two it does not
 * change what depths are rounded to, so a scene is the same picture in another's room. */
static float near_plane(const struct view *v, const struct scene *scene)
{
    float usual = 1e-3f * scene_radius(scene), nearest = scene_nearest(scene, v->eye, 2 * usual);
    if (!scene_is_empty(scene))
        nearest = fminf(nearest, fabsf(v->eye[1] - scene_ground_top(scene)));
    return exp2f(floorf(log2f(fmaxf(0.5f * nearest, LEAST_NEAR * usual))));
}

bool view_resolve(struct view *v, struct pen_camera *c, const struct scene *scene, uint32_t width,
    uint32_t height, struct pen_error *error)
{
    memset(v, 0, sizeof *v);
    v->width = width, v->height = height;
    v->aspect = (float)width / (float)height;
    if (c->mode == PEN_CAMERA_INDEX) {
        if (c->index >= scene->blob.camera_count)
            return pen_fail(error, PEN_INVALID, "/camera/index",
                "The scene has %u cameras; there is no number %u.", scene->blob.camera_count,
                c->index);
        const struct psc_camera *from = &scene->blob.cameras[c->index];
        memcpy(c->eye, from->eye, sizeof c->eye);
        memcpy(c->target, from->target, sizeof c->target);
        memcpy(c->up, from->up, sizeof c->up);
        c->fov_y_deg = from->fov_y_deg;
    } else if (c->mode == PEN_CAMERA_AUTO || c->mode == PEN_CAMERA_ORBIT) {
        if (c->mode == PEN_CAMERA_AUTO)
            turn_to_front(c, scene);
        frame_content(c, scene, v->aspect);
    }
    c->mode = PEN_CAMERA_LOOK_AT;
    scene_point_in(scene, c->eye, v->eye);
    scene_direction(c->eye, c->target, v->forward);
    glm_vec3_normalize(v->forward);
    glm_vec3_cross(v->forward, c->up, v->right);
    if (glm_vec3_norm(v->right) < 1e-4f * glm_vec3_norm(c->up)) {
        /* Looking along `up`: any other axis will do. */
        float other[3] = {0, 0, 0};
        other[fabsf(v->forward[2]) < 0.9f ? 2 : 0] = -1;
        glm_vec3_cross(v->forward, other, v->right);
    }
    glm_vec3_normalize(v->right);
    glm_vec3_cross(v->right, v->forward, v->up);
    v->fov_y_rad = glm_rad(c->fov_y_deg);
    v->near_z = near_plane(v, scene);
    make_matrices(v, 0, 0);
    return true;
}

/* Of the Halton sequence in bases 2 and 3, centred on 0. */
void view_jitter(struct view *v, uint32_t index)
{
    float at[2] = {0, 0};
    for (uint32_t k = 0; k < 2; k++) {
        float scale = 1;
        for (uint32_t i = index + 1; i; i /= k + 2) {
            scale /= (float)(k + 2);
            at[k] += scale * (float)(i % (k + 2));
        }
    }
    make_matrices(v, at[0] - 0.5f, at[1] - 0.5f);
}

void view_to_cull(const struct view *v, struct cull_view *cull)
{
    memset(cull, 0, sizeof *cull);
    memcpy(cull->world_to_clip, v->world_to_clip, sizeof cull->world_to_clip);
    memcpy(cull->eye, v->eye, sizeof cull->eye);
    cull->faces = CULL_SINGLE_SIDED;
}
