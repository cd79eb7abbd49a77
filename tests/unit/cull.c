/* A drawing in pieces: they are what the whole is, in its order; none costs more than it may, but for
 * its last triangle; and what it is said to cost is at least the pixels that its triangles cover, which
 * are counted here one by one. */
#include "renderer/scene/cull.h"
#include "tests/unit/check.h"
#include "tests/unit/random.h"
#include <cglm/cglm.h>

enum {
    MESHLETS = 9,
    EACH = 40,
    TRIANGLES = MESHLETS * EACH,
    INSTANCES = 5,
    WIDTH = 90,
    HEIGHT = 70
};
enum { MOST_PIECES = INSTANCES * TRIANGLES * 4 };

static uint64_t state = 11;
static float positions[3 * TRIANGLES][3];
static uint32_t indices[3 * TRIANGLES];
static struct psc_meshlet meshlets[MESHLETS];
static struct psc_instance instances[INSTANCES];
static float areas[MESHLETS];
static struct cull_command commands[INSTANCES * MESHLETS + 1];

/* A camera somewhere, or a light whose rays are parallel. */
static void make_view(struct cull_view *view)
{
    vec3 target;
    mat4 look, lens;
    memset(view, 0, sizeof *view);
    view->parallel = uniform(&state, 0, 1) < 0.4;
    for (int k = 0; k < 3; k++) {
        view->eye[k] = (float)uniform(&state, -9, 9);
        target[k] = (float)uniform(&state, -2, 2);
    }
    glm_lookat(view->eye, target, (vec3){0.1f, 1, 0.05f}, look);
    float scale = (float)uniform(&state, 0.5, 3);
    glm_mat4_zero(lens);
    if (view->parallel) {
        lens[0][0] = lens[1][1] = scale / 4;
        lens[2][2] = -0.02f, lens[3][2] = 0.5f, lens[3][3] = 1;
    } else {
        lens[0][0] = scale * HEIGHT / WIDTH, lens[1][1] = scale;
        lens[2][3] = -1, lens[3][2] = 0.05f;
    }
    glm_mat4_mul(lens, look, view->world_to_clip);
}

/* Meshlets whose triangles are small, long, or lie over one another. */
static void make_scene(void)
{
    for (uint32_t m = 0; m < MESHLETS; m++) {
        double size = pow(10, uniform(&state, -2, 0.7)), center[3];
        struct psc_meshlet *meshlet = &meshlets[m];
        *meshlet = (struct psc_meshlet){.first_index = 3 * EACH * m, .index_count = 3 * EACH};
        meshlet->cone_cutoff = 2;
        for (int k = 0; k < 3; k++)
            meshlet->center[k] = (float)(center[k] = uniform(&state, -4, 4));
        for (uint32_t i = 0; i < 3 * EACH; i++) {
            uint32_t vertex = 3 * EACH * m + (i * 7) % (3 * EACH);
            float distance = 0;
            indices[meshlet->first_index + i] = vertex;
            for (int k = 0; k < 3; k++) {
                positions[vertex][k] = (float)(center[k] + uniform(&state, -size, size));
                distance = hypotf(distance, positions[vertex][k] - meshlet->center[k]);
            }
            meshlet->radius = fmaxf(meshlet->radius, distance * 1.0001f);
        }
        areas[m] = -1;
    }
    for (uint32_t i = 0; i < INSTANCES; i++) {
        instances[i] = (struct psc_instance){{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}, 0, 0};
        for (int k = 0; k < 12; k++)
            instances[i].world[k] += (float)uniform(&state, -0.7, 0.7);
    }
}

/* Pixels whose centres one triangle covers. */
static uint32_t count_pixels(
    const struct cull_view *view, uint32_t instance, const uint32_t *corners)
{
    double at[3][4];
    uint32_t count = 0;
    for (int i = 0; i < 3; i++)
        for (int row = 0; row < 4; row++) {
            at[i][row] = view->world_to_clip[3][row];
            for (int k = 0; k < 3; k++) {
                const float *w = &instances[instance].world[4 * k], *p = positions[corners[i]];
                double world =
                    (double)w[0] * p[0] + (double)w[1] * p[1] + (double)w[2] * p[2] + w[3];
                at[i][row] += view->world_to_clip[k][row] * world;
            }
        }
    for (int pixel = 0; pixel < WIDTH * HEIGHT; pixel++) {
        double x = (pixel % WIDTH + 0.5) * 2 / WIDTH - 1,
               y = (pixel / WIDTH + 0.5) * 2 / HEIGHT - 1;
        /* Edges in homogeneous coordinates: nothing has to be clipped. */
        double edges[3], w = 0, z = 0;
        int positive = 0, negative = 0;
        for (int i = 0; i < 3; i++) {
            const double *a = at[(i + 1) % 3], *b = at[(i + 2) % 3];
            edges[i] = x * (a[1] * b[3] - a[3] * b[1]) + y * (a[3] * b[0] - a[0] * b[3]) +
                       a[0] * b[1] - a[1] * b[0];
            positive += edges[i] > 0, negative += edges[i] < 0;
        }
        if (positive && negative)
            continue;
        double sum = edges[0] + edges[1] + edges[2];
        for (int i = 0; i < 3; i++)
            w += edges[i] / sum * at[i][3], z += edges[i] / sum * at[i][2];
        count += w > 0 && z >= 0 && z <= w;
    }
    return count;
}

static struct cull_list make_list(const struct psc_scene *scene, double weight)
{
    return (struct cull_list){
        scene, areas, commands, 0, sizeof commands / sizeof *commands, weight};
}

/* All instances in one piece or the rest of them in the next; returns the triangles. */
static uint32_t draw(const struct cull_view *view, struct cull_list *list, struct cull_piece *piece)
{
    uint64_t triangles = 0;
    piece->more = false;
    for (; piece->instance < INSTANCES; piece->instance++) {
        triangles += cull_instance(view, piece->instance, false, list, piece);
        if (piece->more)
            break;
    }
    return (uint32_t)triangles;
}

/* The corners of what a list has, one after the other. */
static uint32_t unroll(const struct cull_list *list, uint32_t out[][4], uint32_t count)
{
    for (uint32_t c = 0; c < list->count; c++)
        for (uint32_t i = 0; i < commands[c].count; i += 3, count++) {
            out[count][0] = commands[c].base_instance;
            memcpy(&out[count][1], &indices[commands[c].first_index + i], 12);
        }
    return count;
}

int main(void)
{
    static uint32_t whole[INSTANCES * TRIANGLES][4], parts[INSTANCES * TRIANGLES][4];
    struct psc_primitive primitive = {
        .vertex_count = 3 * TRIANGLES, .meshlet_count = MESHLETS, .index_count = 3 * TRIANGLES};
    struct psc_scene scene = {.primitives = &primitive,
        .instances = instances,
        .meshlets = meshlets,
        .positions = (const float(*)[3])positions,
        .indices = indices};
    double said = 0, covered = 0;
    uint32_t cut = 0;
    for (int round = 0; round < 12; round++) {
        struct cull_view view;
        double weight = round % 2 ? 1 : 8;
        make_view(&view);
        make_scene();
        struct cull_piece all = {.pixels = WIDTH * HEIGHT, .most = INFINITY};
        struct cull_list list = make_list(&scene, weight);
        uint32_t drawn = draw(&view, &list, &all), count = unroll(&list, whole, 0), got = 0;
        CHECK(drawn == count && !all.more && all.instance == INSTANCES);
        struct cull_piece piece = {
            .pixels = all.pixels, .most = pow(10, uniform(&state, 1, 5)), .more = true};
        uint32_t pieces = 0;
        double sum = 0;
        for (; piece.more && pieces < MOST_PIECES; pieces++) {
            piece.work = 0;
            list = make_list(&scene, weight);
            uint32_t before = got, n = draw(&view, &list, &piece);
            got = unroll(&list, parts, got);
            CHECK(n == got - before);
            /* One triangle too many, and what looking for it costs. */
            CHECK(piece.work < piece.most + weight * WIDTH * HEIGHT + (1 << 17));
            uint32_t pixels = 0;
            for (uint32_t i = before; i < got; i++)
                pixels += count_pixels(&view, parts[i][0], &parts[i][1]);
            CHECK(piece.work >= weight * pixels);
            sum += piece.work;
            covered += weight * pixels;
        }
        CHECK(!piece.more && got == count && !memcmp(whole, parts, count * sizeof *whole));
        said += sum;
        cut += pieces > 1;
    }
    fprintf(stderr, "%u drawings cut; said %.3g, covered %.3g\n", cut, said, covered);
    CHECK(cut > 6);
    CHECK(said < 4 * covered); /* and it is not far too high */
    CHECK_DONE();
}
