/* Emission textures of lights: orientation, means, patterns, animation, and what methods without
 * colour make of them. The reference method must meet the closed form of T5. */
#include "tests/accuracy/textured.h"
#include "tests/unit/check.h"

#define IMAGE_HEX_1 "e101000000000000000000000000000000000000000000000000000000000000"
#define IMAGE_HEX_2 "e102000000000000000000000000000000000000000000000000000000000000"
#define IMAGE_HEX_3 "e103000000000000000000000000000000000000000000000000000000000000"

static const struct planar_case t5 = {.c = 1.2, .h = 3, .a = 0.5};

static void render(const uint8_t *id, const char *method, const char *light, const char *texture,
    struct shot *shot)
{
    char settings[1024];
    snprintf(settings, sizeof settings, "technique=%s&" HARNESS_VIEW "%s&light.texture.%s", method,
        light, texture);
    harness_shot(id, settings, shot);
}

/* Every end of both axes, by a pattern and by images: as seen from the scene, upright, "left" is
 * the light's -x and "top" its +y. */
static void check_orientation(const uint8_t *half_plane)
{
    static const uint8_t left_right[2 * 4] = {255, 0, 0, 255, 0, 255, 0, 255};
    uint8_t id[PEN_ID_BYTES];
    textured_image(1, 2, 1, 1, left_right, id); /* left red */
    textured_image(2, 1, 2, 1, left_right, id); /* top red */
    static const struct {
        int axis, sign;
        const char *texture;
        bool red_is_right;
    } cases[] = {{0, -1, "pattern=two-colour", true}, {0, 1, "pattern=two-colour", false},
        {0, -1, "image=" IMAGE_HEX_1, true}, {0, 1, "image=" IMAGE_HEX_1, false},
        {1, 1, "image=" IMAGE_HEX_2, true}, {1, -1, "image=" IMAGE_HEX_2, false}};
    for (uint32_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct shot shot;
        double worst;
        render(half_plane, "multisample&samples=256&map_size=1024",
            textured_light(cases[i].axis, cases[i].sign), cases[i].texture, &shot);
        double rmse = textured_t5(&shot, &t5, cases[i].red_is_right, &worst);
        fprintf(stderr, "multisample T5 axis %d%+d %.14s: rmse %.5f worst %.4f\n", cases[i].axis,
            cases[i].sign, cases[i].texture, rmse, worst);
        CHECK(rmse < 0.003);
        CHECK(worst < 0.012);
        harness_shot_finish(&shot);
    }
}

/* A method without colours gets the mean colour, and says so; one with colours says nothing. */
static void check_mean(const uint8_t *plane, const uint8_t *half_plane)
{
    static const char *const methods[] = {"none", "hard", "pcf", "pcss", "multisample&samples=64"};
    for (int i = 0; i < 5; i++) {
        struct shot shot;
        render(plane, methods[i], HARNESS_RECT, "pattern=two-colour", &shot);
        for (uint32_t k = 0; k < shot.width * shot.height; k++) {
            const float *v = shot.visibility + 4 * k;
            if (!(fabsf(v[0] - 0.5f) < 4e-3f && fabsf(v[1] - 0.5f) < 4e-3f && v[2] == 0 &&
                    v[3] == 1)) {
                fprintf(stderr, "%s: %g %g %g %g\n", methods[i], (double)v[0], (double)v[1],
                    (double)v[2], (double)v[3]);
                CHECK(false);
                break;
            }
        }
        CHECK((shot.result.warning_count == 0) == (i == 4));
        harness_shot_finish(&shot);
    }
    struct shot shot;
    render(half_plane, "pcss", HARNESS_RECT, "pattern=two-colour", &shot);
    CHECK(textured_t5(&shot, &t5, true, NULL) > 0.1); /* so the test above can fail */
    harness_shot_finish(&shot);
}

/* Row 0 of each shot's visibility where the plane is fully lit is the mean of the texture. */
static void lit_mean(const uint8_t *plane, const char *texture, float rgb[3])
{
    struct shot shot;
    render(plane, "none", HARNESS_RECT, texture, &shot);
    memcpy(rgb, shot.visibility, 12);
    harness_shot_finish(&shot);
}

static void check_patterns(const uint8_t *plane)
{
    float rgb[3], later[3];
    lit_mean(plane, "pattern=checker", rgb);
    CHECK_NEAR(rgb[0], (1 + 0.03) / 2, 2e-3);
    CHECK_NEAR(rgb[1], (0.42 + 0.14) / 2, 2e-3);
    CHECK_NEAR(rgb[2], (1 + 0.04) / 2, 2e-3);
    /* A five-pointed star of outer radius R and inner radius r covers 5 R r sin(36 deg). */
    lit_mean(plane, "pattern=star", rgb);
    double area = 5 * 0.97 * 0.97 * 0.381966 * sin(M_PI / 5);
    for (int k = 0; k < 3; k++)
        CHECK_NEAR(rgb[k], area / 4, 2e-3);
    lit_mean(plane, "pattern=stained-glass", rgb);
    for (int k = 0; k < 3; k++)
        CHECK(rgb[k] > 0.1f && rgb[k] < 0.9f);
    lit_mean(plane, "pattern=candle-flame&time_s=0", rgb);
    lit_mean(plane, "pattern=candle-flame&time_s=0.5", later);
    CHECK(rgb[0] > rgb[1] && rgb[1] > rgb[2] && rgb[2] > 0);
    CHECK(fabsf(rgb[0] - later[0]) > 1e-4f);
    lit_mean(plane, "pattern=candle-flame&time_s=2", later); /* its period */
    CHECK(!memcmp(rgb, later, sizeof rgb));
}

static void check_images(const uint8_t *plane)
{
    /* 24 frames a second, in order, and round again; alpha darkens; any shape keeps its mean. */
    static const uint8_t frames[3][3 * 4] = {{255, 0, 0, 255, 255, 0, 0, 255, 0, 0, 0, 255},
        {0, 255, 0, 255, 0, 255, 0, 255, 0, 0, 0, 255},
        {0, 0, 255, 255, 0, 0, 255, 0, 0, 0, 0, 255}};
    uint8_t id[PEN_ID_BYTES];
    textured_image(3, 3, 1, 3, frames[0], id);
    static const float expected[][3] = {
        {2.0f / 3, 0, 0}, {0, 2.0f / 3, 0}, {0, 0, 1.0f / 3}, {2.0f / 3, 0, 0}};
    for (int i = 0; i < 4; i++) {
        char texture[160];
        float rgb[3];
        snprintf(texture, sizeof texture, "image=" IMAGE_HEX_3 "&time_s=%.6f", i / 24.0);
        lit_mean(plane, texture, rgb);
        for (int k = 0; k < 3; k++)
            CHECK_NEAR(rgb[k], expected[i][k], 1e-3);
    }
    /* The same id with other pixels, after a drop: nothing stale is shown. */
    static const uint8_t grey[4] = {51, 51, 51, 255};
    pen_renderer_drop_scene(harness_renderer(), id);
    textured_image(3, 1, 1, 1, grey, id);
    float rgb[3];
    lit_mean(plane, "image=" IMAGE_HEX_3, rgb);
    CHECK_NEAR(rgb[0], 0.2, 1e-3);
}

int main(void)
{
    uint8_t plane[PEN_ID_BYTES], half_plane[PEN_ID_BYTES];
    harness_scene(&(struct pen_generated_options){.kind = PEN_GENERATED_PLANE}, plane);
    harness_scene(
        &(struct pen_generated_options){.kind = PEN_GENERATED_HALF_PLANE, .caster_height = 1.2f},
        half_plane);
    check_mean(plane, half_plane);
    check_orientation(half_plane);
    check_patterns(plane);
    check_images(plane);
    CHECK_DONE();
}
