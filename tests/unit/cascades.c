/* Cascades: split positions against the closed forms, weights of the light samples, and the
 * property that no blocker of a receiver lies outside its cascade's windows. */
#include "renderer/passes/light/cascades.h"
#include "tests/unit/check.h"
#include <cglm/cglm.h>

static uint32_t seed = 11;

static double random_unit(void)
{
    seed = seed * 1664525u + 1013904223u;
    return (seed >> 8) / 16777216.0;
}

static void check_splits(void)
{
    float z[4];
    /* n = 1, f = 100, three cascades: worked out by hand from the two formulas. */
    static const double practical[] = {1, 19.3208, 44.2722, 100},
                        paper[] = {1.5, 5.1338, 21.9715, 100};
    cascade_splits(1, 100, 3, CASCADE_SPLIT_PRACTICAL, 0.5f, z);
    for (int i = 0; i < 4; i++)
        CHECK_NEAR(z[i], practical[i], 1e-3);
    cascade_splits(1, 100, 3, CASCADE_SPLIT_PAPER, 0.5f, z);
    for (int i = 0; i < 4; i++)
        CHECK_NEAR(z[i], paper[i], 1e-3);
    cascade_splits(2, 54, 3, CASCADE_SPLIT_PRACTICAL, 1, z); /* ratio 3 */
    for (int i = 0; i < 4; i++)
        CHECK_NEAR(z[i], 2 * pow(3, i), 1e-4);
    cascade_splits(2, 5, 3, CASCADE_SPLIT_PRACTICAL, 0, z);
    for (int i = 0; i < 4; i++)
        CHECK_NEAR(z[i], 2 + i, 1e-5);
    for (int t = 0; t < 2000; t++) {
        float n = (float)exp(12 * random_unit() - 6),
              f = n * (float)(1 + exp(9 * random_unit() - 4));
        cascade_splits(n, f, 3, t & 1, (float)random_unit(), z);
        CHECK(z[0] >= n && z[1] >= z[0] && z[2] >= z[1] && z[3] >= z[2]);
        CHECK(z[3] == f);
    }
}

/* Standard deviation of the effective light, as a ratio to the uniform one's: how much wider the
 * samples make its penumbra. */
static double width_ratio(enum cascade_weights mode, uint32_t side)
{
    double sum = 0, square = 0;
    for (uint32_t i = 0; i < side; i++) {
        float at, weight;
        cascade_sample_1d(mode, side, i, &at, &weight);
        sum += weight;
        square += weight * at * at;
    }
    CHECK_NEAR(sum, 1, 1e-6);
    return sqrt(3 * square);
}

static void check_weights(void)
{
    static const double ratios[3][3] = {
        {1.73, 1.41, 1.29}, {1.73, 1.23, 1.11}, {0.866, 0.943, 0.968}};
    for (int mode = 0; mode < 3; mode++)
        for (uint32_t side = 2; side <= 4; side++)
            CHECK_NEAR(width_ratio(mode, side), ratios[mode][side - 2], 0.006);
    for (uint32_t side = 1; side <= CASCADE_MAX_SIDE; side++)
        for (int mode = 0; mode < 3; mode++)
            width_ratio(mode, side);
}

static void look(
    const float eye[3], const float target[3], float right[3], float up[3], float forward[3])
{
    glm_vec3_sub((float *)target, (float *)eye, forward);
    glm_vec3_normalize(forward);
    glm_vec3_cross(forward, (float[]){0, 1, 0}, right);
    glm_vec3_normalize(right);
    glm_vec3_cross(right, forward, up);
}

#define W 96
#define H 64
#define TILE 16

struct stage {
    struct view view;
    struct light light;
    float depth[W * H]; /* reversed; of the ground y = 0 */
    float tiles[W / TILE * (H / TILE)][2];
    struct cascade_tiles layout;
};

static void ray_of(const struct view *v, double x, double y, float ray[3])
{
    float t = tanf(0.5f * v->fov_y_rad);
    for (int k = 0; k < 3; k++)
        ray[k] = v->forward[k] + (float)(2 * x / W - 1) * t * v->aspect * v->right[k] +
                 (float)(1 - 2 * y / H) * t * v->up[k];
}

static void make_stage(struct stage *s, bool parallel)
{
    memset(s, 0, sizeof *s);
    struct view *v = &s->view;
    float target[3] = {(float)random_unit() - 0.5f, 0, (float)random_unit() - 0.5f};
    float eye[3] = {4 * (float)random_unit() - 2, 0.3f + 2 * (float)random_unit(), 3};
    memcpy(v->eye, eye, sizeof eye);
    look(eye, target, v->right, v->up, v->forward);
    v->fov_y_rad = 0.04f + 0.8f * (float)pow(random_unit(), 3); /* most see a part of the shadow */
    v->aspect = (float)W / H;
    v->near_z = 0.01f;
    v->width = W, v->height = H;
    for (int i = 0; i < W * H; i++) {
        float ray[3];
        ray_of(v, i % W + 0.5, i / W + 0.5, ray);
        s->depth[i] = ray[1] < -1e-3f ? v->near_z / (-eye[1] / ray[1]) : 0;
    }
    for (int i = 0; i < W * H; i++) {
        float *tile = s->tiles[i / W / TILE * (W / TILE) + i % W / TILE], d = s->depth[i];
        if (d > 0) {
            tile[0] = tile[1] > 0 ? fminf(tile[0], d) : d;
            tile[1] = fmaxf(tile[1], d);
        }
    }
    s->layout = (struct cascade_tiles){(const float(*)[2])s->tiles, W / TILE, H / TILE, TILE};
    struct light_face *f = &s->light.faces[0];
    float from[3] = {2 * (float)random_unit() - 1, 3, 2 * (float)random_unit() - 1}, x[3], y[3],
          z[3];
    float down[3] = {from[0] + 0.3f, 0, from[2] - 0.4f};
    look(from, down, x, y, z);
    glm_vec3_cross(y, z, x); /* right-handed with z forward */
    for (int k = 0; k < 3; k++) {
        f->world_to_light[k][0] = x[k], f->world_to_light[k][1] = y[k],
        f->world_to_light[k][2] = z[k];
    }
    f->world_to_light[3][0] = -glm_vec3_dot(x, from);
    f->world_to_light[3][1] = -glm_vec3_dot(y, from);
    f->world_to_light[3][2] = -glm_vec3_dot(z, from);
    f->world_to_light[3][3] = 1;
    f->parallel = parallel;
    f->extent[0] = parallel ? 0.1f : 0.5f;
    f->extent[1] = parallel ? 0.1f : 0.3f;
    f->cone_cos = -1;
    f->near_z = 1.2f, f->far_z = 5;
    s->light.face_count = 1;
    for (int k = 0; k < 3; k++) {
        float center = k == 1 ? 0.6f : (float)random_unit() - 0.5f,
              size = 0.1f + 0.4f * (float)random_unit();
        s->light.casters[0][k] = center - size;
        s->light.casters[1][k] = center + size;
    }
    light_face_window(f, s->light.casters, (float[]){0, 0}, f->rect);
}

/* Random points between random receivers and light samples that lie among the casters: the window
 * of the receiver's cascade must show them. Returns how many were looked at. */
static int check_blockers(struct stage *s)
{
    const struct light_face *f = &s->light.faces[0];
    float range[2], splits[CASCADES + 1];
    int looked = 0;
    bool any = cascade_range(&s->view, &s->light, &s->layout, range);
    if (any) {
        cascade_splits(range[0], range[1], CASCADES, CASCADE_SPLIT_PRACTICAL, 0.5f, splits);
        splits[0] = range[0];
    }
    for (int t = 0; t < 2000; t++) {
        int i = (int)(random_unit() * W * H);
        float d = s->depth[i], ray[3], world[3], p[3], c[3];
        if (!(d > 0))
            continue;
        float distance = s->view.near_z / d;
        ray_of(&s->view, i % W + 0.5, i / W + 0.5, ray);
        for (int k = 0; k < 3; k++)
            world[k] = s->view.eye[k] + distance * ray[k];
        glm_mat4_mulv3((vec4 *)f->world_to_light, world, 1, p);
        float uv[2] = {2 * (float)random_unit() - 1, 2 * (float)random_unit() - 1};
        float at[2] = {uv[0] * f->extent[0], uv[1] * f->extent[1]}, u = (float)random_unit();
        /* From the receiver towards the sample. */
        for (int k = 0; k < 3; k++)
            c[k] = f->parallel ? p[k] + 5 * u * (k < 2 ? at[k] : -1)
                               : p[k] + u * ((k < 2 ? at[k] : 0) - p[k]);
        mat4 forward, inverse; /* aligned as cglm wants them */
        float back[3];
        bool inside = c[2] > f->near_z;
        memcpy(forward, f->world_to_light, sizeof forward);
        glm_mat4_inv(forward, inverse);
        glm_mat4_mulv3(inverse, c, 1, back);
        for (int k = 0; k < 3; k++)
            inside = inside && back[k] > s->light.casters[0][k] && back[k] < s->light.casters[1][k];
        if (!inside)
            continue;
        looked++;
        CHECK(any && distance >= range[0] && distance <= range[1]);
        if (!any)
            return looked;
        int number = distance > splits[2] ? 2 : distance > splits[1] ? 1 : 0;
        struct cascade_bounds bounds;
        float rect[4];
        bool seen =
            cascade_bounds(&s->view, f, &s->layout, splits[number], splits[number + 1], &bounds) &&
            cascade_window(f, s->light.casters, &bounds, at, 8, 2, 256, rect);
        CHECK(seen);
        for (int k = 0; seen && k < 2; k++) {
            float l = f->parallel ? c[k] + at[k] * c[2] : at[k] + (c[k] - at[k]) * f->near_z / c[2];
            CHECK(l >= rect[k] && l <= rect[2 + k]);
        }
        if (check_failures > 5)
            return looked;
    }
    return looked;
}

static void check_windows(void)
{
    static struct stage stage;
    int looked = 0;
    for (int t = 0; t < 1200; t++) {
        make_stage(&stage, t & 1);
        looked += check_blockers(&stage);
    }
    fprintf(stderr, "%d blockers\n", looked);
    CHECK(looked > 1000);
}

int main(void)
{
    check_splits();
    check_weights();
    check_windows();
    CHECK_DONE();
}
