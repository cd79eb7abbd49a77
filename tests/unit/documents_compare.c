/* Bodies of comparisons, and their answers. */
#include "protocol/json_compare.h"
#include "tests/unit/check.h"
#include "tests/unit/documents_catalogue.h"
#include <cjson/cJSON.h>

static struct pen_compare compare;
static struct pen_error error;

static bool read_body(const char *text)
{
    memset(&error, 0, sizeof error);
    return pen_compare_from_json(text, strlen(text), &fake_catalogue, "none", &compare, &error);
}

static void refused(const char *text, uint32_t code, const char *pointer)
{
    CHECK(!read_body(text));
    if (error.code != code || strcmp(error.pointer, pointer))
        fprintf(stderr, "%s: %u %s %s\n", text, error.code, error.pointer, error.message);
    CHECK(error.code == code);
    CHECK_STR(error.pointer, pointer);
}

#define HARD "\"reference\":\"hard\""

static void check_methods(void)
{
    CHECK(read_body("{" HARD ",\"width\":90,\"techniques\":[\"pcss\",{\"params\":{\"search_taps\":"
                    "5},\"name\":\"pcss\"},\"hard\"]}"));
    CHECK(compare.count == 3);
    CHECK_STR(compare.requests[0].technique, "hard");
    CHECK_STR(compare.requests[1].technique, "pcss");
    CHECK_STR(compare.requests[3].technique, "hard");
    struct fake_params own, standard;
    memcpy(&own, compare.requests[2].technique_params, sizeof own);
    memcpy(&standard, compare.requests[1].technique_params, sizeof standard);
    CHECK(own.search_taps == 5 && standard.search_taps != 5);
    for (uint32_t i = 0; i <= compare.count; i++)
        CHECK(compare.requests[i].width == 90);
    /* Everything but the method is the same, to the byte. */
    struct pen_request a = compare.requests[1], b = compare.requests[3];
    memcpy(b.technique, a.technique, sizeof a.technique);
    memcpy(b.technique_params, a.technique_params, sizeof a.technique_params);
    CHECK(!memcmp(&a, &b, sizeof a));
}

static void check_all(void)
{
    static const char *const bodies[] = {"{" HARD "}", "{\"techniques\":\"all\"," HARD "}"};
    for (int i = 0; i < 2; i++) {
        CHECK(read_body(bodies[i])); /* not the reference, and "none" is excluded here */
        CHECK(compare.count == 1);
        CHECK_STR(compare.requests[1].technique, "pcss");
        CHECK_STR(compare.warning, "");
    }
}

static void check_refused(void)
{
    refused("{" HARD ",\"techniques\":[\"pcss\",\"nothing\"]}", PEN_INVALID, "/techniques/1");
    refused("{" HARD ",\"techniques\":[{\"name\":\"pcss\",\"params\":{\"bias\":\"x\"}}]}",
        PEN_INVALID, "/techniques/0/params/bias");
    refused("{" HARD ",\"techniques\":[\"none\"]}", PEN_INVALID, "/techniques/0");
    refused("{" HARD ",\"techniques\":[7]}", PEN_INVALID, "/techniques/0");
    refused("{\"reference\":{\"name\":\"hard\",\"params\":{\"no\":1}}}", PEN_INVALID,
        "/reference/params/no");
    refused("{" HARD ",\"techniques\":{}}", PEN_INVALID, "/techniques");
    refused("{" HARD ",\"technique\":\"pcss\"}", PEN_INVALID, "/technique");
    refused("{" HARD ",\"output\":{}}", PEN_INVALID, "/output");
    refused("{" HARD ",\"width\":0}", PEN_INVALID, "/width");
    refused("{" HARD ",\"techniques\":\"all\",\"techniques\":\"all\"}", PEN_INVALID, "/techniques");
    refused("{" HARD ",", PEN_MALFORMED, "");
    refused("", PEN_MALFORMED, "");
    /* This catalogue has neither raytraced nor what stands in for it. */
    refused("{}", PEN_INVALID, "/reference/name");
}

static void check_answer(void)
{
    CHECK(read_body("{" HARD ",\"techniques\":[\"pcss\",\"hard\"]}"));
    struct pen_result results[3] = {{.completed = compare.requests[0]},
        {.completed = compare.requests[1],
            .comparison = {.rmse = 0.25, .penumbra_rmse = 0.5, .ssim = 0.75, .penumbra_pixels = 9}},
        {.error = {.code = PEN_INVALID, .message = "It cannot."}}};
    results[1].stage_ms[PEN_STAGE_SHADOW] = 2;
    results[1].stage_ms[PEN_STAGE_TECHNIQUE] = 3;
    results[1].stage_ms[PEN_STAGE_SHADE] = 5;
    results[1].stage_ms[PEN_STAGE_ENCODE] = 100; /* not the method's */
    struct pen_compared rows[3] = {{.result = &results[0], .image = "/v1/results/a"},
        {.result = &results[1], .ssim_map = "/m"}, {.result = &results[2]}};
    char *text =
        pen_json_put_links(pen_compare_json(&compare, rows, "id", 12, &fake_catalogue), "");
    cJSON *root = cJSON_Parse(text);
    cJSON *methods = cJSON_GetObjectItem(root, "methods");
    cJSON *first = cJSON_GetArrayItem(methods, 0), *second = cJSON_GetArrayItem(methods, 1);
    CHECK(cJSON_GetArraySize(methods) == 2);
    CHECK_NEAR(cJSON_GetObjectItem(first, "rmse")->valuedouble, 0.25, 0);
    CHECK_NEAR(cJSON_GetObjectItem(first, "rmse_penumbra")->valuedouble, 0.5, 0);
    CHECK_NEAR(cJSON_GetObjectItem(first, "shadow_ms")->valuedouble, 5, 0);
    CHECK_NEAR(cJSON_GetObjectItem(first, "total_ms")->valuedouble, 10, 0);
    cJSON *links = cJSON_GetObjectItem(first, "links");
    CHECK_STR(cJSON_GetObjectItem(links, "ssim_map")->valuestring, "/m");
    CHECK(!cJSON_GetObjectItem(links, "image"));
    CHECK_STR(cJSON_GetObjectItem(second, "error")->valuestring, "It cannot.");
    CHECK(!cJSON_GetObjectItem(second, "rmse"));
    cJSON *reference = cJSON_GetObjectItem(root, "reference");
    CHECK(!cJSON_GetObjectItem(reference, "rmse"));
    CHECK_STR(cJSON_GetObjectItem(cJSON_GetObjectItem(reference, "links"), "image")->valuestring,
        "/v1/results/a");
    cJSON_Delete(root);
    free(text);
}

int main(void)
{
    check_methods();
    check_all();
    check_refused();
    check_answer();
    CHECK_DONE();
}
