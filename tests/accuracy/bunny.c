/* The bunny of the shared scenes: the reference converges, and the methods stay near it. Skipped
 * without those scenes: argv[1] is a folder of imported .pscene files. */
#include "tests/accuracy/harness.h"
#include "tests/unit/check.h"

#define VIEW                                                                                       \
    "width=800&height=600&camera.eye=2.2,1.6,2.6&camera.target=0,0.45,0&camera.fov_y_deg=45"       \
    "&light.type=rect&light.position=1.5,3,1&light.target=0,0,0&light.width=1&light.height=1"

static double rmse(const struct shot *a, const struct shot *b)
{
    double sum = 0;
    uint32_t n = a->width * a->height;
    for (uint32_t i = 0; i < n; i++) {
        double e = a->visibility[4 * i + 3] - b->visibility[4 * i + 3];
        sum += e * e;
    }
    return sqrt(sum / n);
}

int main(int argc, char **argv)
{
    uint8_t id[PEN_ID_BYTES];
    char path[512];
    snprintf(path, sizeof path, "%s/stanford-bunny-on-plane.pscene", argc > 1 ? argv[1] : ".");
    if (!harness_scene_file(path, id))
        return 77;
    struct shot few, many, traced, pcss, none;
    harness_shot(id, "technique=multisample&samples=256&" VIEW, &few);
    harness_shot(id, "technique=multisample&samples=1024&map_size=1024&" VIEW, &many);
    harness_shot(id, "technique=raytraced&samples=256&" VIEW, &traced);
    harness_shot(id, "technique=pcss&" VIEW, &pcss);
    harness_shot(id, "technique=none&" VIEW, &none);
    fprintf(stderr, "256 against 1024 samples: rmse %.5f; pcss %.5f; no shadow %.5f\n",
        rmse(&few, &many), rmse(&pcss, &many), rmse(&none, &many));
    fprintf(stderr, "against rays: 1024 maps %.5f, pcss %.5f\n", rmse(&many, &traced),
        rmse(&pcss, &traced));
    CHECK(rmse(&few, &many) < 0.005);
    CHECK(rmse(&many, &traced) < 0.01);
    CHECK(rmse(&pcss, &traced) < 0.0235); /* 0.0244 with the light below horizons for lit */
    CHECK(rmse(&pcss, &many) < 0.5 * rmse(&none, &many));
    CHECK(harness_not_finite(&many) == 0);
    CHECK_DONE();
}
