/* Every kind of device that is there gives the same picture, and none is taken silently. */
#include "tests/gl/fixture.h"
#include "tests/unit/check.h"

int main(void)
{
    static const char *const platforms[] = {NULL, "egl-device", "egl-surfaceless", "osmesa"};
    uint64_t software_hash = 0;
    uint32_t found = 0;
    for (uint32_t device = PEN_DEVICE_GPU; device <= PEN_DEVICE_OSMESA; device++) {
        struct pen_error error;
        struct pen_renderer *renderer = fixture_renderer(device, 0, &error);
        if (!renderer) {
            CHECK(error.code == PEN_UNAVAILABLE && error.message[0]);
            fprintf(stderr, "%s: %s\n", platforms[device], error.message);
            continue;
        }
        found++;
        const struct pen_device_info *info = pen_renderer_device(renderer);
        fprintf(stderr, "%s: %s\n", platforms[device], info->renderer);
        CHECK_STR(info->platform, platforms[device]);
        CHECK(info->renderer[0]);
        uint8_t id[PEN_ID_BYTES];
        struct pen_request request;
        struct pen_result result;
        fixture_scene(renderer, PEN_GENERATED_SQUARE, 0, 0, id);
        fixture_request(&request, id, "pcss");
        uint64_t hash = fixture_render(renderer, &request, &result);
        CHECK_STR(result.device.renderer, info->renderer);
        if (info->software) {
            CHECK(!software_hash || hash == software_hash);
            software_hash = hash;
        }
        pen_renderer_destroy(renderer);
    }
    if (!found)
        return 77;
    /* A required GPU is never replaced by software. */
    struct pen_renderer_config config = {.device = {.require_gpu = true}};
    struct pen_error error = {0};
    struct pen_renderer *renderer = pen_renderer_create(&config, &error);
    CHECK(renderer ? !pen_renderer_device(renderer)->software : error.code == PEN_UNAVAILABLE);
    pen_renderer_destroy(renderer);
    CHECK_DONE();
}
