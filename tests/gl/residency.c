/* What stays in GPU memory between requests, what leaves it, and that neither changes a pixel. */
#include "renderer/gl/release.h"
#include "renderer/gl/target.h"
#include "renderer/gl/timer.h"
#include "tests/gl/fixture.h"
#include "tests/unit/check.h"

static void check_repeats(struct pen_renderer *r, const uint8_t *id)
{
    struct pen_request request;
    struct pen_result result;
    fixture_request(&request, id, "pcss");
    uint64_t first = fixture_render(r, &request, &result);
    CHECK(!result.shadow_inputs_reused);
    for (int i = 0; i < 100; i++) {
        CHECK(fixture_render(r, &request, &result) == first);
        CHECK(result.shadow_inputs_reused);
    }
    /* Only the camera moves: nothing of the light's is rebuilt, and no time is spent on it. Lights
     * that are left to us would move with it. */
    memcpy(request.lights, result.completed.lights, sizeof request.lights);
    request.light_count = result.completed.light_count;
    request.lights_given = 1;
    CHECK(fixture_render(r, &request, &result) && result.shadow_inputs_reused);
    request.camera.mode = PEN_CAMERA_ORBIT;
    request.camera.azimuth_deg += 20;
    CHECK(fixture_render(r, &request, &result) != first);
    CHECK(result.shadow_inputs_reused);
    CHECK(result.stage_ms[PEN_STAGE_SHADOW] == 0);
    /* The light moves: its inputs are new, and the picture changes. */
    struct pen_request other = result.completed;
    uint64_t before = fixture_render(r, &other, &result);
    other.lights[0].position[0] += 0.5f;
    CHECK(fixture_render(r, &other, &result) != before);
    CHECK(!result.shadow_inputs_reused);
}

/* The same light of another size: the map from its centre is the same, and so is the picture that it is
 * drawn anew for. */
static void check_light_size(struct pen_renderer *r, const uint8_t *id)
{
    struct pen_request request;
    struct pen_result result;
    fixture_request(&request, id, "pcss");
    request.lights_given = 1;
    request.light_count = 1;
    pen_light_default(&request.lights[0], PEN_LIGHT_RECT);
    uint64_t first = fixture_render(r, &request, &result);
    request.lights[0].width *= 0.5f;
    uint64_t kept = fixture_render(r, &request, &result);
    CHECK(kept != first);
    CHECK(result.shadow_inputs_reused);
    pen_renderer_drop_shadows(r);
    CHECK(fixture_render(r, &request, &result) == kept);
    CHECK(!result.shadow_inputs_reused);
}

/* The completed request, sent again, gives the same picture: it says all there is to say. */
static void check_completed(struct pen_renderer *r, const uint8_t *id)
{
    struct pen_request request;
    struct pen_result result, again;
    fixture_request(&request, id, "pcss");
    uint64_t first = fixture_render(r, &request, &result);
    CHECK(result.completed.lights_given && result.completed.light_count == 1);
    CHECK(result.completed.camera.mode == PEN_CAMERA_LOOK_AT);
    CHECK(fixture_render(r, &result.completed, &again) == first);
}

static void check_eviction(void)
{
    struct pen_error error;
    const uint64_t budget = 24ull << 20;
    struct pen_renderer *r = fixture_renderer(PEN_DEVICE_AUTO, budget, &error);
    uint8_t ids[4][PEN_ID_BYTES];
    uint64_t first[4];
    struct pen_request request;
    struct pen_result result;
    for (uint32_t i = 0; i < 4; i++) {
        fixture_scene(r, PEN_GENERATED_HAIRBALL, 200000, i + 1, ids[i]);
        fixture_request(&request, ids[i], "pcf");
        first[i] = fixture_render(r, &request, &result);
        CHECK(result.gpu_bytes <= budget && pen_renderer_gpu_bytes(r) <= budget);
    }
    CHECK(!pen_renderer_has_scene(r, ids[0])); /* least recently used */
    CHECK(pen_renderer_has_scene(r, ids[3]));
    for (uint32_t i = 0; i < 4; i++) {
        if (!pen_renderer_has_scene(r, ids[i]))
            fixture_scene(r, PEN_GENERATED_HAIRBALL, 200000, i + 1, ids[i]);
        fixture_request(&request, ids[i], "pcf");
        CHECK(fixture_render(r, &request, &result) == first[i]);
        /* A software device has let go of most of what had to leave. */
        CHECK(!result.device.software || gl_deleted_bytes() < 32 << 20);
    }
    pen_renderer_destroy(r);
}

/* Of many lights, each asked for once, software keeps the maps of the last frames, or as many as a share
 * of the budget holds, and draws the next ones into the oldest of them: the pictures are those of maps
 * made for them. */
static void check_recycling(void)
{
    struct pen_error error;
    const uint64_t budget = 512ull << 20;
    const char *methods[] = {"pcss", "msm", "hard"};
    enum { LIGHTS = 30 };
    struct pen_request request;
    struct pen_result result;
    uint8_t id[PEN_ID_BYTES];
    for (int m = 0; m < 3; m++) {
        struct pen_renderer *r = fixture_renderer(PEN_DEVICE_SURFACELESS, budget, &error);
        uint64_t pictures[LIGHTS], one = 0;
        fixture_scene(r, PEN_GENERATED_HAIRBALL, 2000, 1, id);
        for (int i = 0; i < LIGHTS; i++) {
            fixture_request(&request, id, methods[m]);
            request.camera.mode = PEN_CAMERA_ORBIT; /* whose light moves with it */
            request.camera.azimuth_deg = 11.0f * (float)i;
            pictures[i] = fixture_render(r, &request, &result);
            CHECK(!result.shadow_inputs_reused);
            one = one ? one : result.gpu_bytes;
            uint64_t kept = budget / 8 > 9 * one ? budget / 8 : 9 * one;
            CHECK(result.gpu_bytes <= kept + one);
        }
        pen_renderer_destroy(r);
        for (int i = LIGHTS - 3; i < LIGHTS; i++) {
            r = fixture_renderer(PEN_DEVICE_SURFACELESS, budget, &error);
            fixture_scene(r, PEN_GENERATED_HAIRBALL, 2000, 1, id);
            request.camera.azimuth_deg = 11.0f * (float)i;
            CHECK(fixture_render(r, &request, &result) == pictures[i]);
            pen_renderer_destroy(r);
        }
    }
}

/* Textures that were deleted leave the memory of the process, and nothing else changes. */
static void check_release(const struct pen_renderer *r)
{
    enum { ARRAYS = 8, LAYERS = 8, SIDE = 1024 }; /* 256 MiB */
    struct gl_target arrays[ARRAYS] = {{{0}}}, drawn = {0};
    GLint view[4], framebuffer = 0, program = 1;
    if (!pen_renderer_device(r)->software)
        return;
    gl_release();
    double before = fixture_resident_mib();
    for (uint32_t i = 0; i < ARRAYS; i++) {
        gl_target_fit(&arrays[i], GL_R32F, SIDE, SIDE, LAYERS, 1);
        for (uint32_t layer = 0; layer < LAYERS; layer++) {
            gl_target_aim(&arrays[i], 0, layer);
            gl_target_clear(&arrays[i], (float[4]){1});
            gl.Flush();
        }
    }
    gl_wait();
    double full = fixture_resident_mib();
    for (uint32_t i = 0; i < ARRAYS; i++)
        gl_target_destroy(&arrays[i]);
    gl_wait();
    double deleted = fixture_resident_mib();
    CHECK(gl_deleted_bytes() == (uint64_t)ARRAYS * LAYERS * SIDE * SIDE * 4);
    gl_target_fit(&drawn, GL_RGBA8, 8, 4, 0, 1);
    gl.BindFramebuffer(GL_FRAMEBUFFER, drawn.framebuffer);
    gl.Viewport(1, 2, 3, 4);
    gl.UseProgram(0);
    gl_release();
    double after = fixture_resident_mib();
    gl.GetIntegerv(GL_VIEWPORT, view);
    gl.GetIntegerv(GL_DRAW_FRAMEBUFFER_BINDING, &framebuffer);
    gl.GetIntegerv(GL_CURRENT_PROGRAM, &program);
    CHECK(framebuffer == (GLint)drawn.framebuffer && program == 0);
    gl_target_destroy(&drawn);
    fprintf(stderr, "%.0f MiB: drawn %.0f, deleted %.0f, released %.0f\n", before, full, deleted,
        after);
    CHECK(view[0] == 1 && view[1] == 2 && view[2] == 3 && view[3] == 4);
    CHECK(full > before + 200 && after < before + 24);
    CHECK(gl_deleted_bytes() < 1024);
}

static void check_drop(struct pen_renderer *r, const uint8_t *id)
{
    pen_renderer_drop_scene(r, id);
    CHECK(!pen_renderer_has_scene(r, id));
    struct pen_request request;
    struct pen_result result;
    struct pen_frame frame;
    struct pen_error error = {0};
    fixture_request(&request, id, "none");
    CHECK(!pen_renderer_render(r, &request, &frame, &result, &error));
    CHECK(error.code == PEN_INTERNAL);
}

static void set_param(struct pen_request *request, const char *name, double value)
{
    const struct pen_technique_info *info =
        pen_catalogue_find(pen_renderer_catalogue(), request->technique);
    CHECK(pen_param_store(
        pen_param_find(info->params, name), request->technique_params, &value, "", NULL));
}

static void traced_request(struct pen_request *request, const uint8_t *id)
{
    fixture_request(request, id, "raytraced");
    set_param(request, "backend", 1); /* gpu */
    set_param(request, "samples", 1);
    request->width = 40, request->height = 30;
}

/* The hierarchy that rays need is the scene's: made once, counted, and evicted with it. */
static void check_hierarchy(void)
{
    enum { TRIANGLES = 50000, SCENES = 3 };
    struct pen_error error = {0};
    const uint64_t budget = 16ull << 20;
    struct pen_renderer *r = fixture_renderer(PEN_DEVICE_AUTO, budget, &error);
    uint8_t ids[SCENES][PEN_ID_BYTES], large[PEN_ID_BYTES];
    struct pen_request request;
    struct pen_result result;
    struct pen_frame frame;
    fixture_scene(r, PEN_GENERATED_HAIRBALL, TRIANGLES, 1, ids[0]);
    uint64_t before = pen_renderer_gpu_bytes(r);
    traced_request(&request, ids[0]);
    uint64_t first = fixture_render(r, &request, &result), after = pen_renderer_gpu_bytes(r);
    CHECK(after > before + TRIANGLES * 48 && after < before + TRIANGLES * 150);
    CHECK(result.stage_ms[PEN_STAGE_SHADOW] > 0 && result.gpu_bytes == after);
    CHECK(fixture_render(r, &request, &result) == first);
    CHECK(result.stage_ms[PEN_STAGE_SHADOW] == 0 && pen_renderer_gpu_bytes(r) == after);
    for (uint32_t i = 1; i < SCENES; i++) {
        fixture_scene(r, PEN_GENERATED_HAIRBALL, TRIANGLES, i + 1, ids[i]);
        traced_request(&request, ids[i]);
        fixture_render(r, &request, &result);
        CHECK(pen_renderer_gpu_bytes(r) <= budget);
    }
    CHECK(!pen_renderer_has_scene(r, ids[0]));
    fixture_scene(r, PEN_GENERATED_HAIRBALL, TRIANGLES, 1, ids[0]);
    traced_request(&request, ids[0]);
    CHECK(fixture_render(r, &request, &result) == first);
    /* One that fits only without a hierarchy is refused by this method alone. */
    fixture_scene(r, PEN_GENERATED_HAIRBALL, 6 * TRIANGLES, 1, large);
    traced_request(&request, large);
    CHECK(!pen_renderer_render(r, &request, &frame, &result, &error));
    CHECK(error.code == PEN_TOO_BIG);
    fixture_request(&request, large, "hard");
    fixture_render(r, &request, &result);
    pen_renderer_destroy(r);
}

/* Embree's hierarchy, where the processor's memory is what OpenGL has, too: it counts, and makes
 * room for a picture that would be refused beside it. */
static void check_host_hierarchy(void)
{
    enum { TRIANGLES = 50000 };
    struct pen_error error = {0};
    struct pen_renderer *r = fixture_renderer(PEN_DEVICE_AUTO, 0, &error);
    uint8_t id[PEN_ID_BYTES];
    struct pen_request request;
    struct pen_result result;
    fixture_scene(r, PEN_GENERATED_HAIRBALL, TRIANGLES, 1, id);
    uint64_t before = pen_renderer_gpu_bytes(r);
    traced_request(&request, id);
    set_param(&request, "backend", 2); /* cpu */
    fixture_render(r, &request, &result);
    uint64_t hierarchy = pen_renderer_gpu_bytes(r) - before;
    bool software = result.device.software;
    pen_renderer_destroy(r);
    if (!software)
        return;
    CHECK(hierarchy > TRIANGLES * 48 && hierarchy < TRIANGLES * 1000);
    r = fixture_renderer(PEN_DEVICE_AUTO, before + hierarchy + (1 << 20), &error);
    fixture_scene(r, PEN_GENERATED_HAIRBALL, TRIANGLES, 1, id);
    fixture_render(r, &request, &result);
    fixture_request(&request, id, "hard"); /* takes more than the MiB that is left */
    const struct pen_blobs loaded = {.count = 1, .ids = {id}, .fds = {-1}};
    CHECK(pen_renderer_admit(r, &request, &loaded, &error) == PEN_ADMITTED);
    CHECK(pen_renderer_gpu_bytes(r) < before + hierarchy);
    pen_renderer_destroy(r);
}

int main(void)
{
    struct pen_error error;
    struct pen_renderer *r = fixture_renderer(PEN_DEVICE_AUTO, 0, &error);
    if (!r)
        return 77;
    uint8_t id[PEN_ID_BYTES];
    fixture_scene(r, PEN_GENERATED_DEMO, 0, 0, id);
    check_repeats(r, id);
    check_light_size(r, id);
    check_completed(r, id);
    check_release(r);
    check_drop(r, id);
    pen_renderer_destroy(r);
    check_eviction();
    check_recycling();
    check_hierarchy();
    check_host_hierarchy();
    CHECK_DONE();
}
