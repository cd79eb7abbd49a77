/* The classifier may only skip work, never change a pixel: every method, with and without.
 * accuracy_classifier METHOD SCENE.pscene compares on another scene, by hand. */
#include "tests/accuracy/harness.h"
#include "tests/unit/check.h"

static void compare(const uint8_t *id, const char *method, const char *view)
{
    char settings[768];
    struct shot on, off;
    snprintf(settings, sizeof settings, "technique=%s&classify=on&%s", method, view);
    harness_shot(id, settings, &on);
    snprintf(settings, sizeof settings, "technique=%s&classify=off&%s", method, view);
    harness_shot(id, settings, &off);
    float worst = 0;
    for (uint32_t i = 0; i < 4 * on.width * on.height; i++)
        worst = fmaxf(worst, fabsf(on.visibility[i] - off.visibility[i]));
    const uint32_t *c = on.result.class_pixels;
    fprintf(stderr, "%-14s worst %.5f; lit %u, undecided %u, umbra %u\n", method, (double)worst,
        c[0], c[1], c[2]);
    CHECK(worst < 1.0f / 255);
    uint32_t receivers = harness_receivers(&on), classified = c[0] + c[1] + c[2];
    /* One that finds its work itself counts it, the same both times. */
    uint32_t work = strcmp(method, "denoised") ? receivers : on.result.full_work_pixels;
    CHECK(off.result.class_pixels[0] == 0 && off.result.full_work_pixels == work);
    CHECK(classified == 0 || classified == receivers);
    CHECK(classified ? on.result.full_work_pixels == c[1]
                     : on.result.full_work_pixels == work && work <= receivers);
    harness_shot_finish(&on);
    harness_shot_finish(&off);
}

/* T1 has a known share of each class: the classifier must find most of what is decided. */
static void check_shares(const uint8_t *half_plane)
{
    struct shot shot;
    harness_shot(half_plane,
        "technique=pcss&classify=on&" HARNESS_VIEW
        "&light.type=rect&light.position=0,3,0&light.target=0,0,0&light.up=0,0,-1"
        "&light.width=0.5&light.height=0.5",
        &shot);
    struct planar_case t = {.c = 1.2, .h = 3, .a = 0.25};
    uint32_t truth[3] = {0};
    for (uint32_t i = 0; i < shot.width * shot.height; i++) {
        double v = truth_half_plane(shot.position[4 * i], 0, &t);
        truth[v >= 1 ? 0 : v <= 0 ? 2 : 1]++;
    }
    CHECK(shot.result.class_pixels[0] <= truth[0] && shot.result.class_pixels[0] > truth[0] / 2);
    CHECK(shot.result.class_pixels[2] <= truth[2] && shot.result.class_pixels[2] > truth[2] / 3);
    harness_shot_finish(&shot);
}

int main(int argc, char **argv)
{
    const struct pen_catalogue *catalogue = pen_renderer_catalogue();
    uint8_t demo[PEN_ID_BYTES], half[PEN_ID_BYTES], room[PEN_ID_BYTES], plane[PEN_ID_BYTES];
    harness_scene(&(struct pen_generated_options){.kind = PEN_GENERATED_DEMO}, demo);
    harness_scene(
        &(struct pen_generated_options){.kind = PEN_GENERATED_HALF_PLANE, .caster_height = 1.2f},
        half);
    harness_scene(&(struct pen_generated_options){.kind = PEN_GENERATED_EMPTY_ROOM}, room);
    harness_scene(&(struct pen_generated_options){.kind = PEN_GENERATED_PLANE}, plane);
    for (uint32_t i = 0; i < catalogue->count; i++) {
        const char *name = catalogue->items[i]->name;
        if ((argc > 1 && strcmp(argv[1], name)) ||
            catalogue->items[i]->cost_class == PEN_COST_REFERENCE)
            continue;
        if (argc > 2) {
            uint8_t file[PEN_ID_BYTES];
            CHECK(harness_scene_file(argv[2], file));
            compare(file, name, "width=320&height=240");
            compare(file, name, "width=320&height=240&light.type=sun&light.position=3,1,2");
            compare(file, name, "width=320&height=240&camera.orbit.azimuth_deg=200");
            compare(file, name, "width=320&height=240&light.type=sphere&light.position=0.5,1,0.3");
            continue;
        }
        /* Tiles of a hill, whose skirts turn away from a light on the other side. */
        compare(room, name, "width=240&height=180&light.type=sun&light.position=1,0.3,0.4");
        /* A floor that turns away from a light below it, without thickness. */
        compare(plane, name,
            HARNESS_VIEW "&light.type=rect&light.position=0.3,-3,0.2&light.target=0,0,0"
                         "&light.width=1&light.height=1");
        /* The horizon cuts this one. */
        compare(plane, name,
            HARNESS_VIEW "&light.type=rect&light.position=3,-0.3,0.2&light.target=0,-0.3,0.2"
                         "&light.width=1&light.height=1");
        compare(demo, name, "width=240&height=180&camera.index=0");
        compare(demo, name,
            "width=240&height=180&light.type=sun&light.angular_diameter_deg=4&light.position=1,2,"
            "1");
        /* Both have a cube of maps, most of whose tiles lie in one face. */
        compare(demo, name, "width=240&height=180&light.type=sphere&light.position=1,3,1");
        compare(demo, name, "width=240&height=180&light.type=point&light.position=0.3,1.2,0.8");
        compare(half, name, HARNESS_VIEW HARNESS_RECT);
        compare(half, name, HARNESS_VIEW HARNESS_DISK);
        /* A pyramid with odd levels, whose last one comes earlier than its side suggests. */
        if (pen_param_find(catalogue->items[i]->params, "map_size"))
            compare(demo, name, "map_size=1000&width=240&height=180&camera.index=0");
    }
    if (argc < 2 || !strcmp(argv[1], "pcss")) {
        check_shares(half);
        compare(demo, "pcss", "map_size=999&width=320&height=240&camera.index=0");
    }
    if (argc > 1 && !pen_catalogue_find(catalogue, argv[1]))
        return 77;
    CHECK_DONE();
}
