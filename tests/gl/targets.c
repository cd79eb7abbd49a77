/* What is drawn into: its shape, its framebuffer, and that every byte of it is counted. */
#include "renderer/gl/context.h"
#include "renderer/gl/target.h"
#include "tests/gl/fixture.h"
#include "tests/unit/check.h"

static void check_shape(void)
{
    struct gl_target t = {0};
    gl_target_destroy(NULL);
    gl_target_destroy(&t);
    CHECK(gl_targets_bytes() == 0);
    CHECK(gl_target_fit(&t, GL_RGBA16F, 64, 48, 0, 1));
    CHECK(gl_targets_bytes() == 64 * 48 * 8);
    CHECK(!gl_target_fit(&t, GL_RGBA16F, 64, 48, 0, 1)); /* it fits */
    CHECK(gl_target_fit(&t, GL_RG8, 64, 48, 0, 1) && gl_targets_bytes() == 64 * 48 * 2);
    CHECK(gl_target_fit(&t, GL_RG8, 8, 4, 0, 0)); /* 8 x 4, 4 x 2, 2 x 1, 1 x 1 */
    CHECK(gl_targets_bytes() == (32 + 8 + 2 + 1) * 2 && t.texture.levels == 4);
    CHECK(gl_target_fit(&t, GL_DEPTH_COMPONENT32F, 16, 16, 3, 1));
    CHECK(gl_targets_bytes() == 16 * 16 * 4 * 3);
    CHECK(gl.CheckNamedFramebufferStatus(t.framebuffer, GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE);
    gl_target_destroy(&t);
    CHECK(gl_targets_bytes() == 0 && !t.texture.name && !t.framebuffer);
}

/* Each layer and level is cleared to a number of its own, through the one framebuffer. */
static void check_aim(void)
{
    struct gl_target t = {0};
    float found[3 * 4 * 4];
    gl_target_fit(&t, GL_R32F, 4, 4, 3, 2);
    for (uint32_t i = 0; i < 6; i++) {
        gl_target_aim(&t, i % 2, i / 2);
        gl_target_clear(&t, (float[4]){(float)(1 + i)});
    }
    for (uint32_t level = 0; level < 2; level++) {
        uint32_t texels = level ? 4 : 16;
        gl.GetTextureImage(t.texture.name, (GLint)level, GL_RED, GL_FLOAT, sizeof found, found);
        for (uint32_t i = 0; i < 3 * texels; i++)
            CHECK(found[i] == (float)(1 + 2 * (i / texels) + level));
    }
    gl_target_destroy(&t);
}

/* An 8-bit picture of one light needs, per pixel: depth 4, normals 8, albedo 4, surface 4,
 * visibility 8 and colour 4 bytes; what methods have besides is theirs. */
static void check_frame(void)
{
    const uint64_t pixel = 4 + 8 + 4 + 4 + 8 + 4;
    struct pen_error error;
    struct pen_renderer *r = fixture_renderer(PEN_DEVICE_AUTO, 0, &error);
    struct pen_request request;
    struct pen_result result;
    uint8_t id[PEN_ID_BYTES];
    fixture_scene(r, PEN_GENERATED_SQUARE, 0, 1, id);
    fixture_request(&request, id, "none");
    request.sky.on = 0;
    request.edges = PEN_EDGES_NONE;
    fixture_render(r, &request, &result);
    CHECK(gl_targets_bytes() == pixel * 200 * 150);
    request.width = 320;
    fixture_render(r, &request, &result);
    CHECK(gl_targets_bytes() == pixel * 320 * 150);
    /* Every method's own targets go with the renderer. */
    const struct pen_catalogue *catalogue = pen_renderer_catalogue();
    for (uint32_t i = 0; i < catalogue->count; i++) {
        fixture_request(&request, id, catalogue->items[i]->name);
        request.width = 64, request.height = 48;
        fixture_render(r, &request, &result);
    }
    CHECK(gl_targets_bytes() > pixel * 64 * 48);
    pen_renderer_destroy(r);
    CHECK(gl_targets_bytes() == 0);
}

int main(void)
{
    struct pen_device_config config = {.debug = true};
    struct pen_device_info device;
    struct pen_error error = {0};
    struct gl_context *context = gl_context_create(&config, &device, &error);
    if (!context) {
        fprintf(stderr, "skipped: %s\n", error.message);
        return 77;
    }
    check_shape();
    check_aim();
    CHECK(gl.GetError() == GL_NO_ERROR);
    gl_context_destroy(context);
    check_frame();
    CHECK_DONE();
}
