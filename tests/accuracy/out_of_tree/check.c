/* One line in the registry is enough: the method is in the catalogue and in the OpenAPI document,
 * its parameters are read and reach its shader, and it renders. */
#include "protocol/openapi.h"
#include "tests/accuracy/harness.h"
#include "tests/unit/check.h"
#include <stdlib.h>
#include <string.h>

static void check_share(const uint8_t *id, const char *settings, double share)
{
    struct shot shot;
    uint32_t dark = 0, lit = 0, other = 0;
    harness_shot(id, settings, &shot);
    for (uint32_t i = 0; i < shot.width * shot.height; i++) {
        float v = shot.visibility[4 * i + 3];
        if (fabs(v - share) < 1e-3)
            dark++;
        else if (v == 1)
            lit++;
        else
            other++;
    }
    CHECK(dark > 10000 && lit > 10000 && other == 0);
    harness_shot_finish(&shot);
}

/* Two sets of points that begin and end alike are two sets of maps; the same set is found again. */
static void check_sample_maps(const uint8_t *id)
{
    struct shot shot;
    for (int again = 0; again < 2; again++) {
        harness_shot(id, "technique=sample-probe&" HARNESS_VIEW HARNESS_RECT, &shot);
        CHECK(shot.visibility[3] == 1);
        CHECK(shot.result.shadow_maps == 6);
        CHECK(shot.result.shadow_inputs_reused == (uint32_t)again);
        harness_shot_finish(&shot);
    }
}

int main(void)
{
    const struct pen_catalogue *catalogue = pen_renderer_catalogue();
    uint8_t half[PEN_ID_BYTES];
    CHECK(pen_catalogue_find(catalogue, "dimmed"));
    char *openapi = pen_openapi_json(catalogue, "0");
    CHECK(openapi && strstr(openapi, "Light in the umbra."));
    free(openapi);
    harness_scene(
        &(struct pen_generated_options){.kind = PEN_GENERATED_HALF_PLANE, .caster_height = 1.2f},
        half);
    check_share(half, "technique=dimmed&" HARNESS_VIEW HARNESS_RECT, 0.25);
    check_share(half, "technique=dimmed&share=0.5&" HARNESS_VIEW HARNESS_RECT, 0.5);
    uint8_t demo[PEN_ID_BYTES];
    harness_scene(&(struct pen_generated_options){.kind = PEN_GENERATED_DEMO}, demo);
    check_sample_maps(demo);
    CHECK_DONE();
}
