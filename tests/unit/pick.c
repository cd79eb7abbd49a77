/* Which triangles are drawn where only some tiles are wanted: those with a point in a wanted tile
 * that is not behind all that is wanted there, and of the others few. Points of the triangles are
 * projected here, one by one. */
#include "renderer/scene/pick.h"
#include "tests/unit/check.h"
#include <cglm/cglm.h>

enum { TRIANGLES = 400, POINTS = 100, WIDTH = 403, HEIGHT = 297, TILE = 4 };
enum { ACROSS = (WIDTH + TILE - 1) / TILE, DOWN = (HEIGHT + TILE - 1) / TILE };

static uint64_t state = 5;

static double uniform(double low, double high)
{
    state = state * 6364136223846793005u + 1442695040888963407u;
    return low + (high - low) * (double)(state >> 11) / 9007199254740992.0;
}

/* Reversed depth without a far plane. */
static void make_view(mat4 world_to_clip)
{
    vec3 eye, target;
    mat4 look, lens;
    for (int k = 0; k < 3; k++) {
        eye[k] = (float)uniform(-9, 9);
        target[k] = (float)uniform(-2, 2);
    }
    glm_lookat(eye, target, (vec3){0.1f, 1, 0.05f}, look);
    float scale = (float)uniform(0.5, 3);
    glm_mat4_zero(lens);
    lens[0][0] = scale * HEIGHT / WIDTH, lens[1][1] = scale;
    lens[2][3] = -1, lens[3][2] = 0.05f;
    glm_mat4_mul(lens, look, world_to_clip);
}

/* Some lines of wanted tiles; in half of them only what is near. */
static void make_tiles(float farthest[DOWN * ACROSS])
{
    for (int i = 0; i < DOWN * ACROSS; i++)
        farthest[i] = 2;
    for (int i = 0; i < 12; i++) {
        double x = uniform(0, ACROSS), y = uniform(0, DOWN), angle = uniform(0, 7);
        float depth = i % 2 ? 0.05f / (float)uniform(2, 12) : 0;
        for (int k = 0; k < 20; k++) {
            int column = (int)floor(x + k * cos(angle)), row = (int)floor(y + k * sin(angle));
            if (column >= 0 && column < ACROSS && row >= 0 && row < DOWN)
                farthest[row * ACROSS + column] = depth;
        }
    }
}

static bool is_wanted(mat4 world_to_clip, const float world[12], const float (*corners)[3],
    const float farthest[DOWN * ACROSS])
{
    for (int i = 0; i < POINTS; i++) {
        double a = uniform(0, 1), b = uniform(0, 1), clip[4];
        if (a + b > 1)
            a = 1 - a, b = 1 - b;
        double at[3], p[3];
        for (int k = 0; k < 3; k++)
            p[k] = a * corners[0][k] + b * corners[1][k] + (1 - a - b) * corners[2][k];
        for (int k = 0; k < 3; k++)
            at[k] = world[4 * k] * p[0] + world[4 * k + 1] * p[1] + world[4 * k + 2] * p[2] +
                    world[4 * k + 3];
        for (int k = 0; k < 4; k++)
            clip[k] = world_to_clip[0][k] * at[0] + world_to_clip[1][k] * at[1] +
                      world_to_clip[2][k] * at[2] + world_to_clip[3][k];
        double x = clip[0] / clip[3], y = clip[1] / clip[3];
        if (clip[3] < clip[2] || fabs(x) > 1 || fabs(y) > 1)
            continue;
        int column = (int)((0.5 + 0.5 * x) * WIDTH / TILE);
        int row = (int)((0.5 - 0.5 * y) * HEIGHT / TILE);
        if (clip[2] / clip[3] >= farthest[row * ACROSS + column])
            return true;
    }
    return false;
}

int main(void)
{
    static float positions[5 + 3 * TRIANGLES][3], farthest[DOWN * ACROSS];
    static uint32_t indices[3 * TRIANGLES];
    uint32_t needed = 0, kept = 0;
    for (int round = 0; round < 200; round++) {
        struct psc_instance instance = {{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}, 0, 0};
        for (int i = 0; i < 12; i++) /* sheared, mirrored, flat */
            instance.world[i] += (float)uniform(-0.8, 0.8);
        for (uint32_t i = 0; i < TRIANGLES; i++) {
            double size = pow(10, uniform(-3, i % 16 ? -0.3 : 1)), center[3];
            for (int k = 0; k < 3; k++)
                center[k] = uniform(-3, 3);
            for (uint32_t c = 0; c < 3; c++) {
                indices[3 * i + c] = 5 + 3 * ((i * 7) % TRIANGLES) + c;
                for (int k = 0; k < 3; k++)
                    positions[indices[3 * i + c]][k] = (float)(center[k] + uniform(-size, size));
            }
        }
        struct psc_primitive primitive = {.first_vertex = 5, .vertex_count = 3 * TRIANGLES};
        struct psc_scene scene = {.primitives = &primitive,
            .instances = &instance,
            .positions = (const float(*)[3])positions,
            .indices = indices};
        struct pick_tiles tiles = {
            ACROSS, DOWN, (float)WIDTH / TILE, (float)HEIGHT / TILE, .farthest = farthest};
        struct cull_command commands[] = {
            {3 * TRIANGLES / 2, 1, 0, 0, 0}, {3 * TRIANGLES / 2, 1, 3 * TRIANGLES / 2, 0, 0}};
        struct picked picked = {0};
        uint32_t count = 2, next = 0;
        mat4 view;
        make_view(view);
        make_tiles(farthest);
        memcpy(tiles.world_to_clip, view, sizeof view);
        pick_triangles(&tiles, &scene, commands, 0, &count, &picked);
        CHECK(count == (picked.count > 0));
        CHECK(!count || (commands[0].count == picked.count && !commands[0].first_index));
        for (uint32_t i = 0; i < TRIANGLES; i++) {
            const uint32_t *t = indices + 3 * i;
            bool drawn = next < picked.count && !memcmp(picked.indices + next, t, 12);
            bool need = is_wanted(view, instance.world, positions + t[0], farthest);
            next += drawn ? 3 : 0;
            CHECK(drawn || !need);
            needed += need, kept += drawn;
        }
        CHECK(next == picked.count);
        free(picked.indices);
        free(picked.corners);
    }
    fprintf(stderr, "%u drawn, %u with a point that is wanted\n", kept, needed);
    CHECK(needed > 1000 && kept < 200 * TRIANGLES / 4);
    CHECK_DONE();
}
