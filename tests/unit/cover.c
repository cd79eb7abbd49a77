/* Depths that the CPU draws at places of some pixels, against homogeneous coordinates of those
 * places in double precision (Olano and Greer 1997): triangles of any size, cut by the near plane
 * or not, turned away or not, half of them with holes that a texture cuts. */
#include "renderer/edges/cover.h"
#include "tests/unit/check.h"
#include "tests/unit/random.h"
#include <cglm/cglm.h>

enum { TRIANGLES = 40, WIDTH = 83, HEIGHT = 62, ACROSS = 21, DOWN = 16, FIRST = 8, ROWS = 40 };
enum { ROUNDS = 100, CORNERS = 3 * TRIANGLES, TEXELS = 4 };

static const double near_z = 0.05;
static uint64_t state = 5;

/* Reversed depth without a far plane. */
static void make_view(struct cull_view *view)
{
    vec3 target;
    mat4 look, lens;
    for (int k = 0; k < 3; k++) {
        view->eye[k] = (float)uniform(&state, -4, 4);
        target[k] = (float)uniform(&state, -2, 2);
    }
    glm_lookat(view->eye, target, (vec3){0.1f, 1, 0.05f}, look);
    float scale = (float)uniform(&state, 0.5, 3);
    glm_mat4_zero(lens);
    lens[0][0] = scale * HEIGHT / WIDTH, lens[1][1] = scale;
    lens[2][3] = -1, lens[3][2] = (float)near_z;
    glm_mat4_mul(lens, look, view->world_to_clip);
    view->faces = uniform(&state, 0, 1) < 0.5 ? CULL_SINGLE_SIDED : CULL_NONE;
}

static float positions[CORNERS][3];
static struct psc_attributes attributes[CORNERS];
static uint32_t indices[CORNERS];
static uint8_t texels[4 * TEXELS * TEXELS];

/* The second half has holes, and is seen from both sides. */
static bool has_holes(uint32_t triangle)
{
    return triangle >= TRIANGLES / 2;
}

static void make_triangles(void)
{
    for (uint32_t i = 0; i < TRIANGLES; i++) {
        double size = pow(10, uniform(&state, -2, i % 8 ? 0 : 1)), center[3];
        for (int k = 0; k < 3; k++)
            center[k] = uniform(&state, -2, 2);
        for (uint32_t c = 3 * i; c < 3 * i + 3; c++) {
            indices[c] = c;
            for (int k = 0; k < 3; k++)
                positions[c][k] = (float)(center[k] + uniform(&state, -size, size));
            for (int k = 0; k < 2; k++)
                attributes[c].uv[0][k] = (float)uniform(&state, -2, 2);
            attributes[c].color[3] = 255;
        }
    }
    for (int i = 0; i < TEXELS * TEXELS; i++)
        texels[4 * i + 3] = uniform(&state, 0, 1) < 0.5 ? 0 : 255;
}

static struct psc_texture texture = {0, PSC_REPEAT, PSC_REPEAT, 15};

/* doubt: it may be its neighbour. */
static uint32_t texel_at(double coordinate, uint32_t mode, bool *doubt)
{
    double at = TEXELS * coordinate, i = floor(at);
    *doubt |= fabs(at - round(at)) < 0.02;
    if (mode == PSC_CLAMP)
        return (uint32_t)fmin(fmax(i, 0), TEXELS - 1);
    uint32_t within = (uint32_t)(i - 2 * TEXELS * floor(i / (2 * TEXELS)));
    return within < TEXELS || mode == PSC_REPEAT ? within % TEXELS : 2 * TEXELS - 1 - within;
}

/* What a place shows of one triangle: its depth, or 0. doubt: something near decides. */
static double depth_at(
    const struct cull_view *view, uint32_t triangle, double x, double y, bool *doubt)
{
    double a[3], b[3], w[3], weights[3], sum = 0, through = 0, uv[2] = {0}, facing = 0;
    const float(*corners)[3] = (const float(*)[3])positions + 3 * triangle;
    for (int i = 0; i < 3; i++) {
        double clip[4];
        for (int k = 0; k < 4; k++)
            clip[k] = (double)view->world_to_clip[3][k];
        for (int k = 0; k < 4; k++)
            for (int m = 0; m < 3; m++)
                clip[k] += (double)view->world_to_clip[m][k] * (double)corners[i][m];
        a[i] = clip[0] - (2 * x / WIDTH - 1) * clip[3];
        b[i] = clip[1] - (1 - 2 * y / HEIGHT) * clip[3];
        w[i] = clip[3];
    }
    for (int i = 0; i < 3; i++) {
        int j = (i + 1) % 3, k = (i + 2) % 3;
        weights[i] = a[j] * b[k] - a[k] * b[j];
        sum += weights[i];
        facing +=
            (double)(view->eye[i] - corners[0][i]) *
            ((double)(corners[1][j] - corners[0][j]) * (double)(corners[2][k] - corners[0][k]) -
                (double)(corners[1][k] - corners[0][k]) * (double)(corners[2][j] - corners[0][j]));
    }
    double least = 1;
    for (int i = 0; i < 3; i++) {
        weights[i] /= sum;
        least = fmin(least, weights[i]);
        through += weights[i] * w[i];
        for (int k = 0; k < 2; k++)
            uv[k] += weights[i] * (double)attributes[3 * triangle + (uint32_t)i].uv[0][k];
    }
    if (!(least > -1e-3) || !(through > 0.999 * near_z))
        return 0;
    if (view->faces == CULL_SINGLE_SIDED && !has_holes(triangle) && facing < 0)
        return 0;
    *doubt = least < 1e-3 || through < 1.001 * near_z;
    if (has_holes(triangle)) {
        uint32_t column = texel_at(uv[0], texture.wrap_s, doubt);
        uint32_t row = texel_at(uv[1], texture.wrap_t, doubt);
        if (!*doubt && !texels[4 * (row * TEXELS + column) + 3])
            return 0;
    }
    return near_z / through;
}

static uint32_t seen, sure;
static float bounds[DOWN * ACROSS]; /* how near has to be what is looked for */

static void check_pixel(
    const struct cull_view *view, const struct cover *cover, uint32_t x, uint32_t y)
{
    const struct cover_tile *tile = &cover->tiles[y / COVER_TILE * ACROSS + x / COVER_TILE];
    uint32_t bit = y % COVER_TILE * COVER_TILE + x % COVER_TILE;
    if (!(tile->pixels >> bit & 1))
        return;
    for (uint32_t i = 0; i < COVER_PLACES; i++) {
        double least = 0, most = 0,
               found = (double)cover->depths[tile->slot * COVER_PIXELS + bit][i];
        for (uint32_t t = 0; t < TRIANGLES; t++) {
            bool doubt = false;
            double depth = depth_at(view, t, x + 0.5 + (double)cover_across[i],
                y + 0.5 + (double)cover_down[i], &doubt);
            most = fmax(most, depth);
            least = doubt ? least : fmax(least, depth);
        }
        CHECK(found <= most * 1.001 + 1e-6);
        CHECK(found >= least * 0.999 - 1e-6 || least < (double)bounds[tile->slot]);
        seen += found > 0;
        sure += least > 0 && most == least;
    }
}

int main(void)
{
    static struct cover_tile tiles[DOWN * ACROSS];
    static cover_places depths[DOWN * ACROSS * COVER_PIXELS];
    static float least[DOWN * ACROSS * COVER_PIXELS];
    struct psc_meshlet meshlets[] = {
        {0, CORNERS / 2, {0}, 100, {0}, 2}, {CORNERS / 2, CORNERS / 2, {0}, 100, {0}, 2}};
    struct psc_primitive primitives[] = {{0, CORNERS / 2, 0, CORNERS, 0, 1, 0, 0},
        {CORNERS / 2, CORNERS / 2, 0, CORNERS, 1, 1, 1, 0}};
    struct psc_instance instances[] = {
        {{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}, 0, 0}, {{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}, 1, 0}};
    struct psc_image image = {TEXELS, TEXELS, 1, 0, 0};
    struct psc_material materials[2] = {
        {.base = {.texture = -1}}, {.base_color = {1, 1, 1, 1},
                                       .alpha_mode = PSC_MASK,
                                       .alpha_cutoff = 0.5f,
                                       .base = {.texture = 0, .transform = {1, 0, 0, 0, 1, 0}}}};
    struct scene_group groups[] = {{.first = 0, .count = 1, .material = 0},
        {.first = 1, .count = 1, .material = 1, .double_sided = true, .alpha = true}};
    struct cull_command room[2];
    float areas[] = {-1, -1};
    uint32_t pieces = 0;
    uint32_t order[] = {0, 1};
    struct scene scene = {.groups = groups,
        .group_count = 2,
        .order = order,
        .command_room = room,
        .command_count = 2,
        .meshlet_areas = areas};
    scene.blob = (struct psc_scene){.positions = (const float(*)[3])positions,
        .attributes = attributes,
        .indices = indices,
        .meshlets = meshlets,
        .primitives = primitives,
        .instances = instances,
        .materials = materials,
        .textures = &texture,
        .images = &image,
        .texels = texels};
    struct cover cover = {.width = WIDTH,
        .height = HEIGHT,
        .first = FIRST,
        .rows = ROWS,
        .tiles = tiles,
        .depths = depths,
        .least = least};
    for (int round = 0; round < ROUNDS; round++) {
        struct cull_view view = {0};
        make_view(&view);
        texture.wrap_s = (uint32_t)round % 3, texture.wrap_t = (uint32_t)round / 3 % 3;
        make_triangles();
        areas[0] = areas[1] = -1;
        for (int i = 0; i < DOWN * ACROSS; i++)
            tiles[i] = (struct cover_tile){i % 3 ? 0 : (float)(near_z / uniform(&state, 1, 9)),
                i % 4 ? 0 : (uint32_t)uniform(&state, 0, 65536), (uint32_t)i};
        memset(depths, 0, sizeof depths);
        memset(least, 0, sizeof least);
        for (int i = 0; i < DOWN * ACROSS; i++)
            bounds[i] = tiles[i].farthest;
        memcpy(cover.world_to_clip, view.world_to_clip, sizeof view.world_to_clip);
        struct cull_piece piece = {
            .pixels = 1e7, .most = round % 2 ? (double)INFINITY : uniform(&state, 0, 1e7)};
        do {
            piece.work = 0;
            cover_scene(&scene, &view, &(struct cover_scene){0}, &cover, &piece);
            pieces++;
        } while (piece.more);
        for (uint32_t y = FIRST; y < FIRST + ROWS; y++)
            for (uint32_t x = 0; x < WIDTH; x++)
                check_pixel(&view, &cover, x, y);
    }
    fprintf(stderr, "%u places show something, %u surely; %u pieces\n", seen, sure, pieces);
    CHECK(seen > 10000 && sure > 10000 && pieces > 3 * ROUNDS / 2);
    CHECK_DONE();
}
