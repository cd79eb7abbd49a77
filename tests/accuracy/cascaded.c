/* Cascaded soft shadow maps: lit planes, the width of the penumbra in every cascade, closed forms,
 * what is skipped and what is kept. */
#include "tests/accuracy/textured.h"
#include "tests/unit/check.h"

/* Along the edge of the half-plane: all three cascades see the same penumbra. */
#define ALONG                                                                                      \
    "width=320&height=240&ground=off&camera.eye=0,1,3.9&camera.target=0,0.3,0&camera.fov_y_deg=55"

static uint32_t pass_count(const struct shot *shot, const char *name)
{
    for (uint32_t i = 0; i < shot->result.pass_count; i++)
        if (!strcmp(shot->result.passes[i].name, name))
            return shot->result.passes[i].count;
    return 0;
}

static uint32_t cascades_of(const struct shot *shot)
{
    return pass_count(shot, "cascade near") + pass_count(shot, "cascade middle") +
           pass_count(shot, "cascade far");
}

static void scene(uint32_t kind, float height, uint8_t id[PEN_ID_BYTES])
{
    harness_scene(&(struct pen_generated_options){.kind = kind, .caster_height = height}, id);
}

/* Receivers that are casters themselves, at 60 degrees of incidence and with nothing skipped:
 * exactly lit in all cascades. */
static void check_lit(void)
{
    static const char *const settings[] = {"", "&filter=texels", "&filter=texels&weights=uniform",
        "&weights=trapezoid", "&split=paper"};
    uint8_t room[PEN_ID_BYTES];
    scene(PEN_GENERATED_EMPTY_ROOM, 0, room);
    for (uint32_t i = 0; i < sizeof settings / sizeof *settings; i++) {
        char text[512];
        snprintf(text, sizeof text,
            "technique=cascaded&classify=off&" ALONG "&light.type=rect&light.position=6.9,4,0.3"
            "&light.target=0,0,0&light.width=1&light.height=1%s",
            settings[i]);
        struct shot shot;
        harness_shot(room, text, &shot);
        struct deviation d = harness_deviation(&shot, truth_one, NULL);
        fprintf(stderr, "lit%s: %u cascades, %u maps, worst %g\n", settings[i], cascades_of(&shot),
            shot.result.shadow_maps, d.worst);
        CHECK(d.worst == 0);
        CHECK(d.pixels > 10000);
        CHECK(cascades_of(&shot) == 3);
        CHECK(shot.result.shadow_maps == 29);
        harness_shot_finish(&shot);
    }
}

/* 10-90 % width along the row, in m; NAN when the row does not cross the penumbra. */
static double row_width(const struct shot *shot, uint32_t row)
{
    double at[2] = {NAN, NAN};
    for (int k = 0; k < 2; k++) {
        float level = k ? 0.9f : 0.1f;
        for (uint32_t x = 1; x < shot->width; x++) {
            uint32_t i = row * shot->width + x - 1;
            const float *p = shot->position + 4 * i, *v = shot->visibility + 4 * i;
            if (fabsf(p[1]) > 1e-3f || fabsf(p[5]) > 1e-3f || shot->normal[4 * i + 1] < 0.5f)
                continue;
            if (v[3] < level && v[7] >= level)
                at[k] = p[0] + (p[4] - p[0]) * (level - v[3]) / (v[7] - v[3]);
        }
    }
    return at[1] - at[0];
}

static void check_width(void)
{
    uint8_t id[PEN_ID_BYTES];
    struct shot shot;
    double expected = 0.8 * 2 * 0.5 * 1.2 / 1.8, low = 1e9, high = 0, sums[3] = {0};
    uint32_t rows[3] = {0};
    scene(PEN_GENERATED_HALF_PLANE, 1.2f, id);
    harness_shot(id, "technique=cascaded&" ALONG HARNESS_RECT, &shot);
    CHECK(cascades_of(&shot) == 3);
    double nearest = 1e9, farthest = 0, distance[2];
    for (int pass = 0; pass < 2; pass++)
        for (uint32_t row = 0; row < shot.height; row++) {
            double width = row_width(&shot, row);
            uint32_t center = row * shot.width + shot.width / 2;
            const float *p = shot.position + 4 * center;
            if (!isfinite(width) || fabsf(p[2]) > 3.4f)
                continue;
            distance[0] = hypot(p[2] - 3.9, 1);
            if (pass == 0) {
                nearest = fmin(nearest, distance[0]);
                farthest = fmax(farthest, distance[0]);
                continue;
            }
            low = fmin(low, width);
            high = fmax(high, width);
            int third = (int)(2.999 * (distance[0] - nearest) / (farthest - nearest));
            sums[third] += width;
            rows[third]++;
        }
    for (int i = 0; i < 3; i++) {
        fprintf(stderr, "part %d of the view: width %.4f over %u rows\n", i, sums[i] / rows[i],
            rows[i]);
        CHECK(rows[i] > 3);
        CHECK_NEAR(sums[i] / rows[i], expected, 0.05 * expected);
    }
    fprintf(stderr, "10-90 %% width %.4f to %.4f, expected %.4f\n", low, high, expected);
    CHECK_NEAR(low, expected, 0.1 * expected);
    CHECK_NEAR(high, expected, 0.1 * expected);
    struct planar_case t = {.c = 1.2, .h = 3, .a = 0.5};
    double rmse = harness_deviation(&shot, truth_half_plane, &t).rmse;
    fprintf(stderr, "along the edge: rmse %.5f\n", rmse);
    CHECK(rmse < 0.02);
    harness_shot_finish(&shot);
}

static void check_closed_forms(void)
{
    struct planar_case t = {.c = 1.2, .h = 3, .a = 0.5, .s = 0.4};
    static const struct {
        uint32_t kind;
        const char *light;
        truth_function truth;
        double limit;
    } cases[] = {{PEN_GENERATED_HALF_PLANE, HARNESS_RECT, truth_half_plane, 0.01},
        {PEN_GENERATED_SQUARE, HARNESS_RECT, truth_square, 0.012},
        {PEN_GENERATED_HALF_PLANE, HARNESS_DISK, truth_half_plane_disk, 0.01}};
    for (int i = 0; i < 3; i++) {
        uint8_t id[PEN_ID_BYTES];
        char text[512];
        struct shot shot;
        scene(cases[i].kind, 1.2f, id);
        snprintf(text, sizeof text, "technique=cascaded&" HARNESS_VIEW "%s", cases[i].light);
        harness_shot(id, text, &shot);
        struct deviation d = harness_deviation(&shot, cases[i].truth, &t);
        fprintf(stderr, "T%d: rmse %.5f penumbra %.5f worst %.4f, %u maps in %u cascades\n", i + 1,
            d.rmse, d.rmse_penumbra, d.worst, shot.result.shadow_maps, cascades_of(&shot));
        CHECK(d.rmse < cases[i].limit);
        /* The view is straight down: all receivers are equally far, and two cascades stay empty. */
        CHECK(cascades_of(&shot) == 1);
        CHECK(shot.result.shadow_maps < 17);
        harness_shot_finish(&shot);
    }
}

/* One sample and no kernel: the plain cascaded shadow map. */
static void check_plain(void)
{
    uint8_t id[PEN_ID_BYTES];
    struct shot shot;
    struct planar_case t = {.c = 1.2, .h = 3, .a = 1e-9};
    scene(PEN_GENERATED_HALF_PLANE, 1.2f, id);
    harness_shot(id,
        "technique=cascaded&near_side=1&middle_side=1&far_side=1&near_kernel=1&middle_kernel=1"
        "&far_kernel=1&far_map_size=1024&" ALONG HARNESS_RECT,
        &shot);
    double rmse = harness_deviation(&shot, truth_half_plane, &t).rmse;
    uint32_t grey = 0;
    for (uint32_t i = 0; i < shot.width * shot.height; i++)
        grey += shot.visibility[4 * i + 3] > 0.01f && shot.visibility[4 * i + 3] < 0.99f;
    fprintf(
        stderr, "plain: rmse %.4f, %u maps, %u grey pixels\n", rmse, shot.result.shadow_maps, grey);
    CHECK(shot.result.shadow_maps == 3);
    CHECK(rmse < 0.08); /* two pixels of each row of 320 */
    CHECK(grey < 50);   /* where two cascades' edges blend */
    harness_shot_finish(&shot);
}

/* Maps are kept while the camera stays and drawn again when it moves. */
static void check_kept(void)
{
    static const char *const cameras[] = {"", "", "&camera.eye=1,1,3", ""};
    uint8_t id[PEN_ID_BYTES];
    scene(PEN_GENERATED_SQUARE, 1.1f, id);
    for (int i = 0; i < 4; i++) {
        char text[512];
        struct shot shot;
        snprintf(text, sizeof text, "technique=cascaded&%s%s" HARNESS_RECT,
            i == 2 ? "width=320&height=240&ground=off&camera.target=0,0.3,0" : ALONG, cameras[i]);
        harness_shot(id, text, &shot);
        CHECK(shot.result.shadow_inputs_reused == (i == 1 || i == 3));
        harness_shot_finish(&shot);
    }
}

static void check_textured(void)
{
    uint8_t id[PEN_ID_BYTES];
    static const struct planar_case t = {.c = 1.2, .h = 3, .a = 0.5};
    scene(PEN_GENERATED_HALF_PLANE, 1.2f, id);
    textured_check_t5(id, "technique=cascaded&", &t, 0.02);
}

int main(void)
{
    check_textured();
    check_lit();
    check_width();
    check_closed_forms();
    check_plain();
    check_kept();
    CHECK_DONE();
}
