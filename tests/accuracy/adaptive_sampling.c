/* Adaptive light source subdivision: where it splits, what it converges to, both
 * ways of counting. */
#include "renderer/passes/light/light_tree.h"
#include "tests/accuracy/textured.h"
#include "tests/unit/check.h"

#define METHOD "technique=adaptive-sampling&"

static void scene(uint32_t kind, float height, float half_size, uint8_t id[PEN_ID_BYTES])
{
    harness_scene(
        &(struct pen_generated_options){
            .kind = kind, .caster_height = height, .caster_half_size = half_size},
        id);
}

static uint32_t pass_count(const struct shot *shot, const char *name)
{
    for (uint32_t i = 0; i < shot->result.pass_count; i++)
        if (!strcmp(shot->result.passes[i].name, name))
            return shot->result.passes[i].count;
    return 0;
}

static double rmse_between(const struct shot *a, const struct shot *b)
{
    double sum = 0;
    uint32_t n = a->width * a->height;
    for (uint32_t i = 0; i < n; i++)
        sum += pow(a->visibility[4 * i + 3] - b->visibility[4 * i + 3], 2);
    return sqrt(sum / n);
}

static void check_no_caster(void)
{
    uint8_t id[PEN_ID_BYTES];
    struct shot shot;
    scene(PEN_GENERATED_PLANE, 0, 0, id);
    static const char *const settings[] = {"", "&classify=off", "&count=occlusion_query"};
    for (int i = 0; i < 3; i++) {
        char text[512];
        snprintf(text, sizeof text, METHOD "levels=4&threshold=0&" HARNESS_VIEW HARNESS_RECT "%s",
            settings[i]);
        harness_shot(id, text, &shot);
        CHECK(shot.result.shadow_maps == 4);
        CHECK(harness_deviation(&shot, truth_one, NULL).worst == 0);
        harness_shot_finish(&shot);
    }
}

/* Samples of the tree whose quads are split wherever the line u = cut (of [0, 1])
 * runs through them. */
static uint32_t samples_along(double cut, uint32_t levels)
{
    struct light_tree tree;
    light_tree_begin(&tree);
    for (uint32_t q = 0; q < tree.count; q++) {
        double low = tree.quads[q].x / 16.0, high = low + 1.0 / (1 << tree.quads[q].level);
        if (tree.quads[q].level < levels && low < cut && cut < high)
            light_tree_split(&tree, q);
    }
    return tree.used_count;
}

/* T1 through a window so narrow that the edge's image on the light stays in one of its sixteen
 * columns: light point u hides behind the edge where u = 1/2 - 1.5 x. */
static void check_edge(void)
{
    static const double cuts[] = {0.21875, 0.59375, 0.96875}; /* centres of columns of 1/16 */
    uint8_t id[PEN_ID_BYTES];
    scene(PEN_GENERATED_HALF_PLANE, 1.2f, 0, id);
    for (int i = 0; i < 3; i++) {
        struct shot shots[2];
        double x = (0.5 - cuts[i]) / 1.5;
        for (int query = 0; query < 2; query++) {
            char text[640];
            snprintf(text, sizeof text,
                METHOD "levels=4&threshold=0&kernel=1&map_size=1024&count=%s&width=64&height=64"
                       "&ground=off&camera.eye=%.5f,0.1,0&camera.target=%.5f,0,0&camera.up=0,0,-1"
                       "&camera.fov_y_deg=8" HARNESS_RECT,
                query ? "occlusion_query" : "atomic", x, x);
            harness_shot(id, text, &shots[query]);
        }
        const struct shot *shot = &shots[0];
        uint32_t expected = samples_along(cuts[i], 4), mirrored = samples_along(1 - cuts[i], 4);
        fprintf(stderr, "edge at %.4f of the light: %u samples, expected %u\n", cuts[i],
            shot->result.shadow_maps, expected);
        CHECK(expected == mirrored); /* so the light's x axis may point either way */
        CHECK(shot->result.shadow_maps == expected);
        CHECK(expected < 150);
        /* Columns of equal weight on both sides of the cut, half of the one that
         * it runs through. */
        for (uint32_t k = 0; k < shot->width * shot->height; k++)
            CHECK_NEAR(shot->visibility[4 * k + 3], 1 - cuts[i], 1.0 / 32 + 1e-3);
        CHECK(shots[1].result.shadow_maps == shot->result.shadow_maps);
        CHECK(!memcmp(shots[1].visibility, shot->visibility, 16 * shot->width * shot->height));
        harness_shot_finish(&shots[0]);
        harness_shot_finish(&shots[1]);
    }
}

/* A caster between the corners' views, which all see past it. */
static void check_thin(void)
{
    uint8_t id[PEN_ID_BYTES];
    struct planar_case t = {.c = 1.2, .h = 3, .a = 0.5, .s = 0.07};
    double rmse[3];
    scene(PEN_GENERATED_SQUARE, 1.2f, 0.07f, id);
    for (uint32_t level = 0; level < 3; level++) {
        char text[512];
        struct shot shot;
        snprintf(text, sizeof text,
            METHOD "min_level=%u&width=64&height=64&ground=off&camera.eye=0,0.1,0"
                   "&camera.target=0,0,0&camera.up=0,0,-1&camera.fov_y_deg=50" HARNESS_RECT,
            level);
        harness_shot(id, text, &shot);
        rmse[level] = harness_deviation(&shot, truth_square, &t).rmse;
        fprintf(stderr, "thin caster, forced level %u: %u maps, rmse %.4f\n", level,
            shot.result.shadow_maps, rmse[level]);
        CHECK((shot.result.shadow_maps == 4) == (level == 0));
        harness_shot_finish(&shot);
    }
    CHECK(rmse[1] < 0.5 * rmse[0] && rmse[1] < 0.04);
}

/* Against 256 fixed samples, and the closed forms for a full tree. */
static void check_convergence(void)
{
    uint8_t id[PEN_ID_BYTES];
    struct planar_case t = {.c = 1.2, .h = 3, .a = 0.5, .s = 0.4};
    struct shot ours, reference;
    scene(PEN_GENERATED_DEMO, 0, 0, id);
    harness_shot(id, METHOD "width=320&height=240", &ours);
    harness_shot(
        id, "technique=multisample&samples=256&map_size=512&width=320&height=240", &reference);
    fprintf(stderr, "demo: %u maps, rmse %.5f from %u fixed samples\n", ours.result.shadow_maps,
        rmse_between(&ours, &reference), reference.result.shadow_maps);
    harness_shot_finish(&ours);
    harness_shot_finish(&reference);

    static const char small[] =
        "width=256&height=256&ground=off&camera.eye=0,0.48,0&camera.target=0,0,0&camera.up=0,0,-1"
        "&camera.fov_y_deg=90&light.type=rect&light.position=0,3,0&light.target=0,0,0"
        "&light.up=0,0,-1&light.width=0.1&light.height=0.1";
    char text[640];
    scene(PEN_GENERATED_SQUARE, 0.5f, 0.2f, id);
    snprintf(text, sizeof text, "technique=multisample&samples=256&map_size=1024&%s", small);
    harness_shot(id, text, &reference);
    snprintf(text, sizeof text, METHOD "levels=4&map_size=1024&threshold=1&%s", small);
    harness_shot(id, text, &ours);
    double rmse = rmse_between(&ours, &reference);
    fprintf(stderr, "small light: %u maps, rmse %.5f from %u fixed samples\n",
        ours.result.shadow_maps, rmse, reference.result.shadow_maps);
    CHECK(rmse < 0.01);
    CHECK(ours.result.shadow_maps > 9);
    CHECK(ours.result.shadow_maps < reference.result.shadow_maps / 2);
    harness_shot_finish(&ours);
    harness_shot_finish(&reference);

    static const struct {
        uint32_t kind;
        const char *light;
        truth_function truth;
        double limit;
    } cases[] = {{PEN_GENERATED_HALF_PLANE, HARNESS_RECT, truth_half_plane, 0.012},
        {PEN_GENERATED_SQUARE, HARNESS_RECT, truth_square, 0.02},
        {PEN_GENERATED_HALF_PLANE, HARNESS_DISK, truth_half_plane_disk, 0.012}};
    for (int i = 0; i < 3; i++) {
        scene(cases[i].kind, 1.2f, 0.4f, id);
        snprintf(
            text, sizeof text, METHOD "levels=4&map_size=960&" HARNESS_VIEW "%s", cases[i].light);
        harness_shot(id, text, &ours);
        struct deviation d = harness_deviation(&ours, cases[i].truth, &t);
        fprintf(stderr, "T%d: rmse %.5f penumbra %.5f mean %+.5f, %u maps\n", i + 1, d.rmse,
            d.rmse_penumbra, d.mean, ours.result.shadow_maps);
        CHECK(d.rmse < cases[i].limit);
        CHECK(fabs(d.mean) < 0.003);
        harness_shot_finish(&ours);
    }
}

/* A light from behind and the right, which does not move with the camera. */
#define DEMO_VIEW(eye)                                                                             \
    "&camera.eye=" eye "&camera.target=0,1.4,0&light.position=7.31,10.24,-2.71&"                   \
    "light.target=0,1.4,0&light.width=2.95&light.height=2.95"

/* Against the same maps at all 289 points: what is not split is not missed. */
static void check_uniform(void)
{
    uint8_t id[PEN_ID_BYTES];
    struct shot ours, uniform;
    scene(PEN_GENERATED_DEMO, 0, 0, id);
    harness_shot(id,
        METHOD
        "levels=4&threshold=0.3&map_size=256&width=320&height=240" DEMO_VIEW("6.37,6.58,9.1"),
        &ours);
    harness_shot(id,
        METHOD "levels=4&min_level=4&threshold=0&map_size=256&width=320&height=240" DEMO_VIEW(
            "6.37,6.58,9.1"),
        &uniform);
    double rmse = rmse_between(&ours, &uniform);
    fprintf(stderr, "demo: %u maps, rmse %.5f from %u fixed points\n", ours.result.shadow_maps,
        rmse, uniform.result.shadow_maps);
    CHECK(uniform.result.shadow_maps == 289);
    CHECK(ours.result.shadow_maps < 240);
    CHECK(rmse < 0.01);
    harness_shot_finish(&ours);
    harness_shot_finish(&uniform);
}

/* Both ways of counting choose the same samples; maps are kept, also while the camera moves. */
static void check_counting_and_keeping(void)
{
    uint8_t id[PEN_ID_BYTES];
    struct shot shots[3];
    scene(PEN_GENERATED_DEMO, 0, 0, id);
    static const char *const settings[] = {METHOD "width=240&height=180" DEMO_VIEW("6.37,6.58,9.1"),
        METHOD "width=240&height=180&count=occlusion_query" DEMO_VIEW("6.37,6.58,9.1"),
        METHOD "width=240&height=180" DEMO_VIEW("6.05,6.58,9.32")};
    for (int i = 0; i < 3; i++)
        harness_shot(id, settings[i], &shots[i]);
    fprintf(stderr, "atomic %u, occlusion queries %u, moved %u maps\n", shots[0].result.shadow_maps,
        shots[1].result.shadow_maps, shots[2].result.shadow_maps);
    CHECK(shots[0].result.shadow_maps > 4);
    CHECK(shots[0].result.shadow_maps == shots[1].result.shadow_maps);
    CHECK(!memcmp(shots[0].visibility, shots[1].visibility, 16 * shots[0].width * shots[0].height));
    CHECK(shots[1].result.shadow_inputs_reused);
    CHECK(pass_count(&shots[1], "sample maps") == 0);
    CHECK(shots[2].result.shadow_maps > 4);
    CHECK(pass_count(&shots[2], "sample maps") == 0 || !shots[2].result.shadow_inputs_reused);
    CHECK(pass_count(&shots[2], "sample maps") < 4);
    for (int i = 0; i < 3; i++)
        harness_shot_finish(&shots[i]);
}

static void check_textured(void)
{
    uint8_t id[PEN_ID_BYTES];
    static const struct planar_case t = {.c = 1.2, .h = 3, .a = 0.5};
    scene(PEN_GENERATED_HALF_PLANE, 1.2f, 0, id);
    textured_check_t5(id, METHOD, &t, 0.03);
}

int main(void)
{
    check_textured();
    check_no_caster();
    check_edge();
    check_thin();
    check_convergence();
    check_uniform();
    check_counting_and_keeping();
    CHECK_DONE();
}
