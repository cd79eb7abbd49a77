/* Documents that are sent: requests come back as the same bytes, records and problems parse. */
#include "protocol/json_request.h"
#include "protocol/number.h"
#include "protocol/json_result.h"
#include "protocol/json_scan.h"
#include "tests/unit/check.h"
#include "tests/unit/documents_catalogue.h"
#include <cjson/cJSON.h>

static uint64_t seed = 20;

static uint32_t random_u32(void) /* splitmix64 */
{
    uint64_t z = seed += 0x9e3779b97f4a7c15ull;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
    return (uint32_t)((z ^ (z >> 31)) >> 32);
}

static double random_unit(void)
{
    return random_u32() / 4294967295.0;
}

/* A value inside the row's range: its ends, its default, or anything, many magnitudes apart. */
static void randomise_row(const struct pen_param *row, void *object)
{
    struct pen_error error = {0};
    double values[4];
    if (row->type == PEN_PARAM_TEXT) {
        static const char *const names[] = {"", "walk", "12", "L\xc3\xa4uft \"schnell\""};
        CHECK(pen_param_store_text(row, object, names[random_u32() % 4], "", &error));
        return;
    }
    do {
        error.code = PEN_OK;
        for (uint32_t i = 0; i < row->count; i++) {
            double low = row->min, high = row->max;
            if (row->type == PEN_PARAM_FLAG)
                low = 0, high = 1;
            for (high = row->choices ? 0 : high; row->choices && row->choices[(int)high + 1];)
                high++;
            uint32_t kind = random_u32() % 8;
            double v = kind == 0 ? low : kind == 1 ? high : low + random_unit() * (high - low);
            if (kind == 2)
                v = row->def_v[i];
            if (kind > 5) /* small magnitudes: many significant digits after the point */
                v = fmin(high,
                    fmax(low, (random_unit() - 0.5) * pow(10, -((double)(random_u32() % 9)))));
            values[i] = pen_param_is_real(row) ? v : floor(v);
        }
    } while (!pen_param_store(row, object, values, "", &error));
}

static void randomise_table(struct pen_param_table table, void *object, uint32_t bit)
{
    for (uint32_t r = 0; r < table.count; r++)
        if (!bit || !table.rows[r].applies || (table.rows[r].applies & bit))
            randomise_row(&table.rows[r], object);
}

static void randomise(struct pen_request *request)
{
    struct pen_error error;
    do {
        pen_request_default(request, &fake_catalogue);
        const struct pen_technique_info *info =
            fake_catalogue.items[random_u32() % fake_catalogue.count];
        memset(request->technique, 0, sizeof request->technique);
        memset(request->technique_params, 0, sizeof request->technique_params);
        strcpy(request->technique, info->name);
        randomise_table(info->params, request->technique_params, 0);
        randomise_table(pen_request_table(), request, 0);
        randomise_table(pen_delivery_table(), &request->delivery, 0);
        randomise_table(pen_output_table(), &request->output, 0);
        static const uint32_t depths[] = {0, 8, 16, 32};
        request->output.bit_depth = depths[random_u32() % 4];
        request->camera.mode = random_u32() % 4;
        randomise_table(pen_camera_table(), &request->camera, PEN_CAMERA_BIT(request->camera.mode));
        request->lights_given = random_u32() % 2;
        request->light_count = request->lights_given ? random_u32() % (PEN_MAX_LIGHTS + 1) : 0;
        for (uint32_t i = 0; i < request->light_count; i++) {
            struct pen_light *light = &request->lights[i];
            pen_light_default(light, random_u32() % PEN_LIGHT_TYPES);
            randomise_table(pen_light_table(), light, PEN_LIGHT_BIT(light->type));
            bool has_radiance = light->type <= PEN_LIGHT_SPHERE;
            if (has_radiance && random_u32() % 2)
                light->power_w = 0;
            if (light->power_w != 0 || !has_radiance)
                light->radiance = 0;
            light->texture = light->type == PEN_LIGHT_RECT ? random_u32() % 3 : 0;
            if (light->texture == PEN_TEXTURE_PATTERN)
                light->pattern = random_u32() % 5;
            for (int b = 0; light->texture == PEN_TEXTURE_IMAGE && b < PEN_ID_BYTES; b++)
                light->image[b] = (uint8_t)random_u32();
        }
        error = (struct pen_error){0};
    } while (!pen_request_check(request, &fake_catalogue, &error));
}

static void test_round_trip(void)
{
    uint32_t lights = 0, modes = 0;
    for (int n = 0; n < 20000; n++) {
        struct pen_request request, back;
        struct pen_error error = {0};
        randomise(&request);
        lights += request.light_count;
        modes |= 1u << request.camera.mode;
        char *text = pen_request_json(&request, &fake_catalogue);
        bool ok = pen_request_from_json(text, strlen(text), &fake_catalogue, &back, &error);
        if (!ok || memcmp(&request, &back, sizeof back)) {
            fprintf(
                stderr, "%d: %s\n%u %s %s\n", n, text, error.code, error.pointer, error.message);
            check_failures++;
            free(text);
            return;
        }
        free(text);
    }
    CHECK(lights > 20000 && modes == 15);
}

static void test_numbers(void)
{
    char text[32];
    pen_print_float(0.02f, text);
    CHECK_STR(text, "0.02");
    pen_print_float(100, text);
    CHECK_STR(text, "100");
    pen_print_float(-2.2f, text);
    CHECK_STR(text, "-2.2");
    pen_print_float(16777216, text);
    CHECK_STR(text, "16777216");
    pen_print_double(0.1, text);
    CHECK_STR(text, "0.1");
    pen_print_double(8192, text);
    CHECK_STR(text, "8192");
    for (int n = 0; n < 100000; n++) {
        union {
            uint32_t bits;
            float value;
        } f = {random_u32()};
        if (!isfinite(f.value))
            continue;
        pen_print_float(f.value, text);
        CHECK((float)strtod(text, NULL) == f.value);
    }
}

static const cJSON *at(const cJSON *root, const char *path)
{
    char copy[128], *save = NULL;
    snprintf(copy, sizeof copy, "%s", path);
    for (char *key = strtok_r(copy, ".", &save); key && root; key = strtok_r(NULL, ".", &save))
        root = cJSON_IsArray(root) ? cJSON_GetArrayItem(root, atoi(key))
                                   : cJSON_GetObjectItemCaseSensitive(root, key);
    return root;
}

/* Parses what was written and frees the text. */
static cJSON *parsed(char *text)
{
    struct pen_error error = {0};
    if (!pen_json_scan(text, strlen(text), 32, &error))
        fprintf(stderr, "%s\n%s\n", text, error.message), check_failures++;
    cJSON *root = cJSON_Parse(text);
    free(text);
    return root;
}

static void test_record(void)
{
    static struct pen_result result;
    struct pen_record_extra extra = {"abc", "/v1/x", "\"etag\"", 12.5, true};
    pen_request_default(&result.completed, &fake_catalogue);
    result.completed.scene[0] = 0xab;
    snprintf(result.device.renderer, sizeof result.device.renderer, "llvmpipe");
    result.device.software = 1;
    pen_result_warn(&result, "a \"quoted\" \xff warning\n");
    result.stage_ms[PEN_STAGE_TECHNIQUE] = 1.25f;
    result.pass_count = 2;
    result.passes[1] = (struct pen_pass_time){"filter", PEN_STAGE_TECHNIQUE, 3, 0.5f};
    result.class_pixels[1] = 17;
    result.gpu_bytes = 1ull << 40;
    result.scene_was_resident = 1;
    cJSON *root = parsed(pen_json_put_links(pen_result_json(&result, &extra, &fake_catalogue), ""));
    CHECK_NEAR(at(root, "request.width")->valuedouble, 800, 0);
    CHECK_STR(at(root, "request.technique.name")->valuestring, "pcss");
    CHECK(!strncmp(at(root, "scene")->valuestring, "ab000", 5));
    CHECK_STR(at(root, "warnings.0")->valuestring, "a \"quoted\" \xef\xbf\xbd warning\n");
    CHECK_STR(at(root, "device.renderer")->valuestring, "llvmpipe");
    CHECK(cJSON_IsTrue(at(root, "device.software")) && cJSON_IsTrue(at(root, "cache.result")));
    CHECK(cJSON_IsTrue(at(root, "cache.scene_resident")));
    CHECK(cJSON_IsFalse(at(root, "cache.shadow_inputs_reused")));
    CHECK_NEAR(at(root, "stages_ms.technique")->valuedouble, 1.25, 0);
    CHECK_NEAR(at(root, "stages_ms.encode")->valuedouble, 0, 0);
    CHECK_STR(at(root, "passes.1.name")->valuestring, "filter");
    CHECK_STR(at(root, "passes.1.stage")->valuestring, "technique");
    CHECK_NEAR(at(root, "passes.1.count")->valuedouble, 3, 0);
    CHECK_NEAR(at(root, "pixels.penumbra")->valuedouble, 17, 0);
    CHECK_NEAR(at(root, "gpu_bytes")->valuedouble, 1099511627776.0, 0);
    CHECK_NEAR(at(root, "total_ms")->valuedouble, 12.5, 0);
    CHECK_STR(at(root, "image.href")->valuestring, "/v1/x");
    cJSON_Delete(root);
    cJSON_Delete(parsed(pen_result_json(&result, NULL, &fake_catalogue)));

    char timing[512];
    pen_server_timing(&result, 3, timing, sizeof timing);
    CHECK_STR(timing, "queue;dur=0.000, load;dur=0.000, gbuffer;dur=0.000, shadow;dur=0.000, "
                      "technique;dur=1.250, shade;dur=0.000, readback;dur=0.000, "
                      "encode;dur=0.000, total;dur=3.000");
    pen_server_timing(&result, 3, timing, 40);
    CHECK_STR(timing, "queue;dur=0.000, load;dur=0.000");
}

static void test_problem(void)
{
    struct pen_error error = {0};
    pen_fail(&error, PEN_INVALID, "/width", "width is \"%s\".", "\x80\x01");
    cJSON *root = parsed(pen_problem_json(&error, 422, "Unprocessable Content", false, "id-1"));
    CHECK_STR(at(root, "type")->valuestring, "about:blank");
    CHECK_STR(at(root, "title")->valuestring, "Unprocessable Content");
    CHECK_NEAR(at(root, "status")->valuedouble, 422, 0);
    CHECK_STR(at(root, "pointer")->valuestring, "/width");
    CHECK_STR(at(root, "detail")->valuestring, "width is \"\xef\xbf\xbd\x01\".");
    CHECK(cJSON_IsFalse(at(root, "retryable")));
    CHECK_STR(at(root, "request_id")->valuestring, "id-1");
    cJSON_Delete(root);
    error = (struct pen_error){0};
    pen_fail(&error, PEN_UNAVAILABLE, "", "Full.");
    root = parsed(pen_problem_json(&error, 503, "Service Unavailable", true, NULL));
    CHECK(cJSON_IsTrue(at(root, "retryable")) && !at(root, "pointer") && !at(root, "request_id"));
    cJSON_Delete(root);
}

static void test_descriptions(void)
{
    cJSON *root = parsed(pen_techniques_json(&fake_catalogue));
    CHECK(cJSON_GetArraySize(at(root, "techniques")) == 3);
    CHECK_STR(at(root, "techniques.2.name")->valuestring, "pcss");
    CHECK_STR(at(root, "techniques.2.cost_class")->valuestring, "medium");
    CHECK_STR(at(root, "techniques.2.params.4.default")->valuestring, "quadtree");
    CHECK_NEAR(at(root, "techniques.2.params.2.default")->valuedouble, 0.02, 0);
    CHECK(cJSON_IsTrue(at(root, "techniques.2.params.2.exclusive_min")));
    CHECK_NEAR(at(root, "techniques.2.params.3.default.1")->valuedouble, 0.5, 0);
    cJSON_Delete(root);

    struct pen_scene_camera camera = {{1, 2, 3}, {0, 0, 0}, {0, 1, 0}, 40, "front"};
    struct pen_scene_light light = {.name = "lamp"};
    pen_light_default(&light.light, PEN_LIGHT_SPOT);
    static const char warnings[] = "first\0second";
    struct pen_scene_info scene = {.triangles = 69453,
        .stored_unix_s = 86400,
        .bounds_min = {-1, 0, -1},
        .bounds_max = {1, 2.5f, 1},
        .camera_count = 1,
        .cameras = &camera,
        .light_count = 1,
        .lights = &light,
        .warnings = warnings,
        .warning_bytes = sizeof warnings};
    root = parsed(pen_scene_json(&scene));
    CHECK_NEAR(at(root, "triangles")->valuedouble, 69453, 0);
    CHECK_STR(at(root, "stored_at")->valuestring, "1970-01-02T00:00:00Z");
    CHECK_NEAR(at(root, "bounds.max.1")->valuedouble, 2.5, 0);
    CHECK_STR(at(root, "cameras.0.name")->valuestring, "front");
    CHECK_STR(at(root, "lights.0.light.type")->valuestring, "spot");
    CHECK(!at(root, "lights.0.light.width") && at(root, "lights.0.light.outer_cone_deg"));
    CHECK(cJSON_GetArraySize(at(root, "warnings")) == 2);
    CHECK_STR(at(root, "warnings.1")->valuestring, "second");
    cJSON_Delete(root);
    scene.bounds_min[0] = 2;
    root = parsed(pen_scene_json(&scene));
    CHECK(cJSON_IsNull(at(root, "bounds")));
    cJSON_Delete(root);
    struct pen_image_info image = {.width = 4, .height = 2};
    root = parsed(pen_image_json(&image));
    CHECK_NEAR(at(root, "width")->valuedouble, 4, 0);
    cJSON_Delete(root);
}

/* What another process reports is refused, or can be printed. */
static void test_receive(void)
{
    static struct pen_result sound, r;
    pen_request_default(&sound.completed, &fake_catalogue);
    CHECK(pen_result_receive(&sound, &fake_catalogue));
    r = sound;
    memset(&r.device, 'x', sizeof r.device);
    memset(&r.error, 'x', sizeof r.error);
    memset(r.warnings, 'x', sizeof r.warnings);
    memset(r.passes[0].name, 'x', sizeof r.passes[0].name);
    r.pass_count = 1;
    r.warning_count = PEN_MAX_WARNINGS;
    CHECK(pen_result_receive(&r, &fake_catalogue));
    CHECK(strlen(r.device.renderer) == sizeof r.device.renderer - 1);
    CHECK(strlen(r.warnings[PEN_MAX_WARNINGS - 1]) == sizeof r.warnings[0] - 1);
    CHECK(strlen(r.passes[0].name) == sizeof r.passes[0].name - 1);
    CHECK(r.error.code == PEN_INTERNAL && strlen(r.error.message) < sizeof r.error.message);
    free(pen_result_json(&r, NULL, &fake_catalogue));
#define REFUSED(change)                                                                            \
    do {                                                                                           \
        r = sound;                                                                                 \
        change;                                                                                    \
        CHECK(!pen_result_receive(&r, &fake_catalogue));                                           \
    } while (0)
    REFUSED(r.warning_count = PEN_MAX_WARNINGS + 1);
    REFUSED(r.pass_count = PEN_MAX_PASSES + 1);
    REFUSED((r.pass_count = 1, r.passes[0].stage = PEN_STAGES));
    REFUSED(r.completed.light_count = PEN_MAX_LIGHTS + 1);
    REFUSED((r.completed.light_count = 1, r.completed.lights[0].type = PEN_LIGHT_TYPES));
    REFUSED(r.completed.output.format = PEN_FORMATS);
    REFUSED(r.completed.camera.mode = 99);
    REFUSED(memset(r.completed.technique, 'x', sizeof r.completed.technique));
    REFUSED(memset(r.completed.delivery.session, 'x', sizeof r.completed.delivery.session));
}

int main(void)
{
    test_receive();
    test_numbers();
    test_round_trip();
    test_record();
    test_problem();
    test_descriptions();
    CHECK_DONE();
}
