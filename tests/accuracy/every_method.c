/* What must hold for every registered method, found through the registry. */
#include "tests/accuracy/harness.h"
#include "tests/unit/check.h"

static void check_lit_exactly(const char *method, const uint8_t *id, const char *light)
{
    char settings[1024];
    snprintf(settings, sizeof settings, "technique=%s&" HARNESS_VIEW "%s", method, light);
    struct shot shot;
    harness_shot(id, settings, &shot);
    struct deviation d = harness_deviation(&shot, truth_one, NULL);
    if (d.worst > 0 || harness_not_finite(&shot))
        fprintf(stderr, "%s%s: worst %.6f\n", method, light, d.worst);
    CHECK(d.worst == 0);
    CHECK(d.pixels > 10000);
    CHECK(harness_not_finite(&shot) == 0);
    harness_shot_finish(&shot);
}

/* T7: a lit plane stays exactly lit from 5 to 85 degrees of incidence. */
static void check_incidence(const char *method, const uint8_t *id)
{
    static const int angles[] = {5, 30, 60, 75, 85};
    for (uint32_t i = 0; i < sizeof angles / sizeof *angles; i++) {
        double t = angles[i] * M_PI / 180;
        char light[256];
        snprintf(light, sizeof light,
            "&light.type=rect&light.position=%.4f,%.4f,0.3&light.target=0,0,0&light.width=0.4"
            "&light.height=0.4",
            8 * sin(t), 8 * cos(t));
        check_lit_exactly(method, id, light);
    }
}

static void check_finite(const char *method, const uint8_t *id)
{
    char settings[512];
    snprintf(settings, sizeof settings, "technique=%s&width=160&height=120", method);
    struct shot shot;
    harness_shot(id, settings, &shot);
    CHECK(harness_not_finite(&shot) == 0);
    for (uint32_t i = 0; i < 4 * shot.width * shot.height; i++)
        if (!(shot.visibility[i] >= -1e-3f && shot.visibility[i] <= 1.001f)) {
            fprintf(
                stderr, "%s: visibility %g out of [0, 1]\n", method, (double)shot.visibility[i]);
            CHECK(false);
            break;
        }
    harness_shot_finish(&shot);
}

int main(int argc, char **argv)
{
    const struct pen_catalogue *catalogue = pen_renderer_catalogue();
    uint8_t plane[PEN_ID_BYTES], room[PEN_ID_BYTES], demo[PEN_ID_BYTES], mask[PEN_ID_BYTES];
    harness_scene(&(struct pen_generated_options){.kind = PEN_GENERATED_PLANE}, plane);
    harness_scene(&(struct pen_generated_options){.kind = PEN_GENERATED_EMPTY_ROOM}, room);
    harness_scene(&(struct pen_generated_options){.kind = PEN_GENERATED_DEMO}, demo);
    harness_scene(&(struct pen_generated_options){.kind = PEN_GENERATED_PLANAR_MASK}, mask);
    for (uint32_t i = 0; i < catalogue->count; i++) {
        const char *name = catalogue->items[i]->name;
        if (argc > 1 && strcmp(argv[1], name))
            continue;
        check_lit_exactly(name, plane, HARNESS_RECT);
        check_lit_exactly(name, plane, HARNESS_DISK);
        check_lit_exactly(name, plane, "&light.type=sun&light.position=1,2,0.5");
        check_lit_exactly(
            name, plane, "&light.type=sphere&light.position=0.5,1.5,0&light.radius=0.2");
        check_lit_exactly(name, plane, "&light.type=point&light.position=0.5,1.5,0");
        check_lit_exactly(name, plane, "&light.type=spot&light.position=0.5,1.5,0");
        check_lit_exactly(name, room, HARNESS_RECT);
        check_incidence(name, plane);
        check_finite(name, demo);
        check_finite(name, mask);
    }
    if (argc > 1 && !pen_catalogue_find(catalogue, argv[1]))
        return 77;
    CHECK_DONE();
}
