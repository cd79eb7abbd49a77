/* Temporal light sampling: frames of a session against closed forms, with a camera that stands still
 * and one that goes round, and what belongs to a session. */
#include "tests/accuracy/harness.h"
#include "tests/unit/check.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

static const struct planar_case half_plane = {.c = 1, .h = 3, .a = 0.5};

#define METHOD "technique=temporal&edges=none&sky=off"
#define SMALL                                                                                      \
    "&width=160&height=160&ground=off&camera.eye=0,0.9,0&camera.target=0,0,0&camera.up=0,0,-1"     \
    "&camera.fov_y_deg=90"

static void scene(uint32_t kind, uint8_t id[PEN_ID_BYTES])
{
    harness_scene(&(struct pen_generated_options){.kind = kind, .caster_height = 1}, id);
}

static void take(
    const uint8_t id[PEN_ID_BYTES], const char *session, const char *more, struct shot *shot)
{
    char text[768];
    snprintf(text, sizeof text, METHOD HARNESS_RECT "&session=%s%s", session, more);
    harness_shot(id, text, shot);
}

static double difference(const struct shot *a, const struct shot *b)
{
    double worst = 0;
    for (uint32_t i = 0; i < a->width * a->height; i++)
        worst = fmax(worst, fabs(a->visibility[4 * i + 3] - b->visibility[4 * i + 3]));
    return worst;
}

/* After N frames the picture is that of all their samples, and converges to the truth. */
static void check_still(const uint8_t id[PEN_ID_BYTES])
{
    double rmse[4];
    uint32_t k = 0;
    for (uint32_t frame = 1; frame <= 64; frame++) {
        struct shot shot;
        take(id, "still", SMALL, &shot);
        CHECK(shot.result.history_frames == frame - 1);
        CHECK(shot.result.history_share == (frame > 1 ? 1.0f : 0.0f));
        struct deviation d = harness_deviation(&shot, truth_half_plane, &half_plane);
        CHECK(d.pixels > 10000);
        if (frame == 1 || frame == 4 || frame == 16 || frame == 64) {
            fprintf(stderr, "still, frame %u: rmse in the penumbra %.4f, worst %.4f\n", frame,
                d.rmse_penumbra, d.worst);
            rmse[k++] = d.rmse_penumbra;
        }
        if (frame == 1) {
            struct shot alone;
            take(id, "", SMALL, &alone);
            CHECK(difference(&shot, &alone) == 0);
            CHECK(alone.result.history_frames == 0 && alone.result.history_share == 0);
            harness_shot_finish(&alone);
        }
        if (frame == 4) {
            struct shot at_once; /* half floats hold the visibility */
            take(id, "", SMALL "&samples=16", &at_once);
            CHECK(difference(&shot, &at_once) <= 1.0 / 2048);
            harness_shot_finish(&at_once);
        }
        harness_shot_finish(&shot);
    }
    /* n RMS < 0.52 at n = 4 and < 0.43 n^(1/4) beyond, as of Owen-scrambled nets, and the texels of
     * the maps. */
    CHECK(rmse[0] < 0.15);
    CHECK(rmse[1] < 0.6 * rmse[0]);
    CHECK(rmse[2] < 0.3 * rmse[0]);
    CHECK(rmse[3] < 0.012);
}

/* A camera that goes round over the penumbra: no frame is as far from the truth as one alone. */
static void check_orbit(const uint8_t id[PEN_ID_BYTES])
{
    double with = 0, without = 0, worst = 0;
    float least = 1;
    for (uint32_t frame = 0; frame < 24; frame++) {
        char text[256];
        double angle = 6.0 * frame * M_PI / 180;
        snprintf(text, sizeof text,
            "&width=160&height=120&ground=off&camera.eye=%.5f,0.6,%.5f&camera.target=0,0,0"
            "&camera.fov_y_deg=60",
            0.9 * sin(angle), 0.9 * cos(angle));
        struct shot shot, alone;
        take(id, "orbit", text, &shot);
        if (frame >= 16) {
            take(id, "", text, &alone);
            struct deviation a = harness_deviation(&shot, truth_half_plane, &half_plane),
                             b = harness_deviation(&alone, truth_half_plane, &half_plane);
            CHECK(a.pixels > 5000);
            with += a.rmse_penumbra, without += b.rmse_penumbra;
            worst = fmax(worst, a.rmse_penumbra / b.rmse_penumbra);
            least = fminf(least, shot.result.history_share);
            harness_shot_finish(&alone);
        }
        harness_shot_finish(&shot);
    }
    fprintf(stderr, "orbit: %.4f with history, %.4f without, at worst %.2f; share %.3f\n", with / 8,
        without / 8, worst, least);
    CHECK(worst < 0.6);
    CHECK(least > 0.8f && least <= 1);
}

/* Visibility of one against that of another, root mean square. */
static double apart(const struct shot *a, const struct shot *b)
{
    double sum = 0;
    for (uint32_t i = 0; i < a->width * a->height; i++) {
        double d = a->visibility[4 * i + 3] - b->visibility[4 * i + 3];
        sum += d * d;
    }
    return sqrt(sum / (a->width * a->height));
}

/* Round a scene of twigs, leaves and bars, much of which each frame shows for the first time and
 * whose shadows are as narrow as pixels: how far from what many samples of the same maps give. */
static void check_fine_orbit(void)
{
    uint8_t id[PEN_ID_BYTES];
    scene(PEN_GENERATED_DEMO, id);
    double worst = 0;
    for (uint32_t frame = 0; frame < 26; frame++) {
        char view[512], text[768];
        snprintf(view, sizeof view,
            "edges=none&sky=off&ground=on&width=160&height=120&map_size=512&camera.orbit.azimuth_"
            "deg=%u"
            "&camera.orbit.elevation_deg=30&light.type=rect&light.position=-6,22.6,19.6"
            "&light.target=0,1.4,0&light.up=0,1,0&light.width=5.9&light.height=5.9",
            185 + 6 * frame);
        struct shot ours, alone, limit;
        snprintf(text, sizeof text, "technique=temporal&session=fine&%s", view);
        harness_shot(id, text, &ours);
        if (frame >= 16 && frame % 3 == 1) {
            snprintf(text, sizeof text, "technique=temporal&%s", view);
            harness_shot(id, text, &alone);
            snprintf(text, sizeof text, "technique=multisample&samples=256&%s", view);
            harness_shot(id, text, &limit);
            double with = apart(&ours, &limit), without = apart(&alone, &limit);
            fprintf(
                stderr, "fine, frame %u: %.4f with history, %.4f without\n", frame, with, without);
            worst = fmax(worst, with / without);
            harness_shot_finish(&alone);
            harness_shot_finish(&limit);
        }
        harness_shot_finish(&ours);
    }
    CHECK(worst < 0.6);
}

static void expect_frames(
    const uint8_t id[PEN_ID_BYTES], const char *session, const char *more, uint32_t frames)
{
    struct shot shot;
    take(id, session, more, &shot);
    if (shot.result.history_frames != frames)
        fprintf(stderr, "%s: %u frames, not %u\n", more, shot.result.history_frames, frames);
    CHECK(shot.result.history_frames == frames);
    CHECK((shot.result.history_share > 0) == (frames > 0));
    CHECK(harness_not_finite(&shot) == 0);
    harness_shot_finish(&shot);
}

/* What a session cannot go on from is forgotten. */
static void check_sessions(const uint8_t id[PEN_ID_BYTES], const uint8_t other[PEN_ID_BYTES])
{
    static const char *const others[] = {"&samples=5", "&map_size=512", "&width=96&height=97",
        "&light.power_w=50", "&light.color=1,0.5,1", "&casters=front", "&ground=on",
        "&light.texture.pattern=checker", "&weighting=g"};
    char text[512];
    expect_frames(id, "a", SMALL, 0);
    for (uint32_t i = 0; i < sizeof others / sizeof *others; i++) {
        bool size = strstr(others[i], "width=96"), ground = strstr(others[i], "ground=on");
        snprintf(text, sizeof text, "%s%s",
            size     ? "&camera.eye=0,0.9,0"
            : ground ? "&width=160&height=160"
                     : SMALL,
            others[i]);
        expect_frames(id, "a", text, 0);
        expect_frames(id, "a", text, 1);
    }
    expect_frames(id, "a", SMALL, 0);
    expect_frames(other, "a", SMALL, 0);
    expect_frames(id, "a", SMALL, 0);
    expect_frames(id, "b", SMALL, 0);
    expect_frames(id, "a", SMALL, 1);
    /* Anything else of a request may change. */
    expect_frames(id, "a", SMALL "&exposure_ev=2&ground_albedo=1,0,0", 2);
    expect_frames(id, "a", SMALL "&antialias=3", 3);
    expect_frames(id, "a", SMALL, 4);
}

int main(void)
{
    uint8_t id[PEN_ID_BYTES], room[PEN_ID_BYTES];
    scene(PEN_GENERATED_HALF_PLANE, id);
    scene(PEN_GENERATED_EMPTY_ROOM, room);
    check_still(id);
    check_orbit(id);
    check_fine_orbit();
    check_sessions(id, room);
    CHECK_DONE();
}
