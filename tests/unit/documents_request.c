/* Request bodies: what is accepted, what is refused and where the pointer points. */
#include "protocol/json_request.h"
#include "tests/unit/check.h"
#include "tests/unit/documents_catalogue.h"

static struct pen_request request;
static struct pen_error error;

static bool parse(const char *text)
{
    error = (struct pen_error){0};
    return pen_request_from_json(text, strlen(text), &fake_catalogue, &request, &error);
}

static void refused(const char *text, uint32_t code, const char *pointer, const char *message)
{
    bool ok = parse(text);
    if (!ok && error.code == code && !strcmp(error.pointer, pointer) &&
        strstr(error.message, message))
        return;
    fprintf(stderr, "%s\n  gave %u \"%s\": %s\n  expected %u \"%s\": %s\n", text, error.code,
        error.pointer, error.message, code, pointer, message);
    check_failures++;
}

static struct fake_params params(void)
{
    struct fake_params p;
    memcpy(&p, request.technique_params, sizeof p);
    return p;
}

static void test_defaults(void)
{
    struct pen_request expected;
    pen_request_default(&expected, &fake_catalogue);
    CHECK(parse("{}"));
    CHECK(!memcmp(&expected, &request, sizeof request));
    CHECK_STR(request.technique, "pcss");
    CHECK(request.width == 800 && request.height == 600 && request.ground.on == 1);
    CHECK(request.lights_given == 0 && request.camera.mode == PEN_CAMERA_AUTO);
    CHECK(params().search_taps == 16 && params().offset == -2 && params().mode == 1);
    CHECK(params().bias == 0.02f && params().tint[1] == 0.5f && params().rotate.on == 1);
    /* Values that equal the defaults change nothing, -0 is 0, and order does not matter. */
    CHECK(parse(" {\"sky_intensity\":1.0,\"time_s\":-0.0,\"technique\":{\"params\":{\"mode\":"
                "\"quadtree\"}},"
                "\"output\":{},\"camera\":{},\"width\":8e2}\r\n"));
    CHECK(!memcmp(&expected, &request, sizeof request));
}

static void test_values(void)
{
    CHECK(parse("{\"technique\":{\"params\":{\"search_taps\":64,\"offset\":-8,\"bias\":0.1,"
                "\"tint\":[0,1,0.125],\"mode\":\"stratified\",\"rotate\":false},\"name\":\"pcss\"},"
                "\"camera\":{\"eye\":[2.2,1.6,2.6],\"target\":[0,0.45,0],\"fov_y_deg\":45},"
                "\"lights\":[{\"type\":\"rect\",\"position\":[1.5,3,1],\"target\":[0,0,0],"
                "\"width\":1,\"height\":2,\"power_w\":100,\"texture\":{\"pattern\":\"checker\"}},"
                "{\"type\":\"disk\",\"radius\":0.25,\"radiance\":7},{\"type\":\"sun\","
                "\"angular_diameter_deg\":1,\"irradiance\":2}],\"ground\":false,"
                "\"ambient\":[0.1,0.2,0.3],\"tone_map\":\"aces\",\"antialias\":4,"
                "\"output\":{\"format\":\"exr\",\"layer\":\"all\",\"bit_depth\":32},"
                "\"deadline_ms\":1000,\"priority\":\"batch\"}"));
    CHECK(params().search_taps == 64 && params().offset == -8 && params().bias == 0.1f);
    CHECK(params().tint[2] == 0.125f && params().mode == 2 && params().rotate.on == 0);
    CHECK(request.camera.mode == PEN_CAMERA_LOOK_AT && request.camera.eye[1] == 1.6);
    CHECK(request.lights_given == 1 && request.light_count == 3);
    CHECK(request.lights[0].height == 2 && request.lights[0].power_w == 100);
    CHECK(request.lights[0].texture == PEN_TEXTURE_PATTERN);
    CHECK_STR(pen_pattern_names[request.lights[0].pattern], "checker");
    CHECK(request.lights[1].type == PEN_LIGHT_DISK && request.lights[1].power_w == 0);
    CHECK(request.lights[1].radiance == 7 && request.lights[1].radius == 0.25f);
    CHECK(request.lights[2].irradiance == 2 && request.lights[2].angular_diameter_deg == 1);
    CHECK(request.ground.on == 0 && request.ambient[2] == 0.3f && request.antialias == 4);
    CHECK(request.tone_map == PEN_TONE_ACES && request.output.format == PEN_EXR);
    CHECK(request.output.layer == PEN_LAYER_ALL && request.output.bit_depth == 32);
    CHECK(request.delivery.deadline_ms == 1000);
    CHECK(request.delivery.priority == PEN_PRIORITY_BATCH);

    CHECK(parse("{\"technique\":\"hard\"}"));
    float width;
    memcpy(&width, request.technique_params, 4);
    CHECK_STR(request.technique, "hard");
    CHECK(width == 0.5f && request.technique_params[1] == 0);

    CHECK(parse("{\"lights\":[]}") && request.lights_given == 1 && request.light_count == 0);
    CHECK(parse("{\"camera\":{\"index\":3}}") && request.camera.mode == PEN_CAMERA_INDEX);
    CHECK(request.camera.index == 3);
    CHECK(parse("{\"camera\":{\"orbit\":{\"azimuth_deg\":-30},\"fov_y_deg\":20}}"));
    CHECK(request.camera.mode == PEN_CAMERA_ORBIT && request.camera.azimuth_deg == -30);
    CHECK(request.camera.elevation_deg == 25 && request.camera.fov_y_deg == 20);
    /* The ends of a range that single precision cannot hold exactly are still inside it. */
    CHECK(parse("{\"camera\":{\"orbit\":{\"elevation_deg\":89.9}}}"));
    CHECK(parse("{\"camera\":{\"orbit\":{\"elevation_deg\":-89.9}}}"));
    CHECK(parse("{\"lights\":[{\"texture\":{\"image\":\"000102030405060708090a0b0c0d0e0f"
                "101112131415161718191a1b1c1d1eff\"}}]}"));
    CHECK(request.lights[0].texture == PEN_TEXTURE_IMAGE && request.lights[0].image[31] == 0xff);
    CHECK(request.lights[0].image[16] == 0x10);
}

static void test_keys(void)
{
    refused("{\"widht\":1}", PEN_INVALID, "/widht", "did you mean \"width\"");
    refused("{\"zzz\":1}", PEN_INVALID, "/zzz", "There is no key \"zzz\" here.");
    refused("{\"Width\":1}", PEN_INVALID, "/Width", "did you mean \"width\"");
    refused("{\"scene\":1}", PEN_INVALID, "/scene", "There is no key");
    refused("{\"a/b~c\":1}", PEN_INVALID, "/a~1b~0c", "There is no key");
    refused("{\"\":1}", PEN_INVALID, "/", "There is no key");
    refused(
        "{\"technique\":{\"nane\":1}}", PEN_INVALID, "/technique/nane", "did you mean \"name\"");
    refused("{\"technique\":{\"params\":{\"search_tap\":1}}}", PEN_INVALID,
        "/technique/params/search_tap", "did you mean \"search_taps\"");
    refused("{\"technique\":{\"name\":\"hard\",\"params\":{\"search_taps\":1}}}", PEN_INVALID,
        "/technique/params/search_taps", "There is no key");
    refused("{\"camera\":{\"fov\":40}}", PEN_INVALID, "/camera/fov", "There is no key");
    refused("{\"camera\":{\"fov_deg\":40}}", PEN_INVALID, "/camera/fov_deg", "mean \"fov_y_deg\"");
    refused(
        "{\"camera\":{\"azimuth_deg\":40}}", PEN_INVALID, "/camera/azimuth_deg", "There is no key");
    refused("{\"camera\":{\"orbit\":{\"eye\":1}}}", PEN_INVALID, "/camera/orbit/eye",
        "There is no key");
    refused("{\"lights\":[{},{\"colour\":[1,1,1]}]}", PEN_INVALID, "/lights/1/colour",
        "mean \"color\"");
    refused("{\"lights\":[{\"texture\":{\"imag\":1}}]}", PEN_INVALID, "/lights/0/texture/imag",
        "mean \"image\"");
    refused("{\"output\":{\"fromat\":\"png\"}}", PEN_INVALID, "/output/fromat", "mean \"format\"");
    refused("{\"width\":10,\"width\":10}", PEN_INVALID, "/width", "given twice");
    refused("{\"width\":10,\"w\\u0069dth\":10}", PEN_INVALID, "/width", "given twice");
    refused("{\"technique\":{\"name\":\"hard\",\"name\":\"pcss\"}}", PEN_INVALID, "/technique/name",
        "given twice");
    refused("{\"camera\":{\"orbit\":{\"distance\":1,\"distance\":1}}}", PEN_INVALID,
        "/camera/orbit/distance", "given twice");
    refused("{\"lights\":[{\"type\":\"sun\",\"type\":\"rect\"}]}", PEN_INVALID, "/lights/0/type",
        "given twice");
    /* Keys that exclude each other or do not apply. */
    refused("{\"camera\":{\"index\":0,\"orbit\":{}}}", PEN_INVALID, "/camera/orbit", "exclude");
    refused("{\"camera\":{\"eye\":[1,1,1],\"index\":0}}", PEN_INVALID, "/camera/eye", "exclude");
    refused(
        "{\"camera\":{\"index\":0,\"fov_y_deg\":30}}", PEN_INVALID, "/camera/fov_y_deg", "has no");
    refused("{\"camera\":{\"target\":[0,0,0]}}", PEN_INVALID, "/camera/target", "without an eye");
    refused("{\"camera\":{\"orbit\":{},\"up\":[0,0,1]}}", PEN_INVALID, "/camera/up", "in orbit");
    refused("{\"lights\":[{\"radius\":1}]}", PEN_INVALID, "/lights/0/radius",
        "A rect light has no radius");
    refused(
        "{\"lights\":[{\"type\":\"sun\",\"power_w\":1}]}", PEN_INVALID, "/lights/0/power_w", "sun");
    refused("{\"lights\":[{\"width\":1,\"type\":\"sphere\"}]}", PEN_INVALID, "/lights/0/width",
        "sphere");
    refused("{\"lights\":[{\"radiance\":1,\"power_w\":1}]}", PEN_INVALID, "/lights/0/radiance",
        "exclude");
    refused("{\"lights\":[{\"type\":\"disk\",\"texture\":{\"pattern\":\"star\"}}]}", PEN_INVALID,
        "/lights/0/texture", "has no texture");
    refused("{\"lights\":[{\"texture\":{}}]}", PEN_INVALID, "/lights/0/texture", "either");
    refused("{\"lights\":[{\"texture\":{\"pattern\":\"star\",\"image\":\"00000000000000000000000000"
            "00000000000000000000000000000000000000\"}}]}",
        PEN_INVALID, "/lights/0/texture", "either");
    refused("{\"lights\":[{},{},{},{},{},{},{},{},{}]}", PEN_INVALID, "/lights", "At most 8");
    CHECK(parse("{\"lights\":[{},{},{},{},{},{},{},{}]}") && request.light_count == 8);
    /* A key too long for the pointer: the pointer stays valid, and names the parent. */
    char text[600] = "{\"lights\":[{\"";
    memset(text + strlen(text), 'x', 300);
    strcat(text, "\":1}]}");
    refused(text, PEN_INVALID, "/lights/0", "There is no key \"xxxxxxxx");
}

static void test_types(void)
{
    static const char *const not_objects[] = {"1", "\"x\"", "true", "null", "[]"};
    for (int i = 0; i < 5; i++) {
        char text[80];
        refused(not_objects[i], PEN_INVALID, "", "object");
        snprintf(text, sizeof text, "{\"camera\":%s}", not_objects[i]);
        refused(text, PEN_INVALID, "/camera", "object");
        snprintf(text, sizeof text, "{\"output\":%s}", not_objects[i]);
        refused(text, PEN_INVALID, "/output", "object");
        snprintf(text, sizeof text, "{\"lights\":[%s]}", not_objects[i]);
        refused(text, PEN_INVALID, "/lights/0", "object");
        snprintf(text, sizeof text, "{\"technique\":{\"params\":%s}}", not_objects[i]);
        refused(text, PEN_INVALID, "/technique/params", "object");
        if (i != 1) {
            snprintf(text, sizeof text, "{\"technique\":%s}", not_objects[i]);
            refused(text, PEN_INVALID, "/technique", "name or an object");
            snprintf(text, sizeof text, "{\"tone_map\":%s}", not_objects[i]);
            refused(text, PEN_INVALID, "/tone_map", "must be a string");
        }
        if (i != 0) {
            snprintf(text, sizeof text, "{\"width\":%s}", not_objects[i]);
            refused(text, PEN_INVALID, "/width", "must be a number");
        }
        if (i != 2) {
            snprintf(text, sizeof text, "{\"ground\":%s}", not_objects[i]);
            refused(text, PEN_INVALID, "/ground", "true, false or shadow");
        }
        snprintf(text, sizeof text, "{\"ambient\":%s}", not_objects[i]);
        refused(text, PEN_INVALID, "/ambient", "array of 3 numbers");
    }
    refused("{\"lights\":{}}", PEN_INVALID, "/lights", "array");
    refused("{\"lights\":null}", PEN_INVALID, "/lights", "array");
    refused("{\"ambient\":[1,2]}", PEN_INVALID, "/ambient", "array of 3");
    refused("{\"ambient\":[1,2,3,4]}", PEN_INVALID, "/ambient", "array of 3");
    refused("{\"ambient\":[1,\"2\",3]}", PEN_INVALID, "/ambient/1", "number");
    refused("{\"camera\":{\"eye\":[1,2,[3]]}}", PEN_INVALID, "/camera/eye/2", "number");
    refused("{\"technique\":\"pcs\"}", PEN_INVALID, "/technique", "did you mean \"pcss\"");
    refused(
        "{\"technique\":{\"name\":\"vsm\"}}", PEN_INVALID, "/technique/name", "no method called");
    refused("{\"technique\":{\"name\":7}}", PEN_INVALID, "/technique/name", "string");
    refused("{\"tone_map\":\"acse\"}", PEN_INVALID, "/tone_map", "did you mean \"aces\"");
    refused("{\"tone_map\":\"filmic\"}", PEN_INVALID, "/tone_map", "none, reinhard, aces");
    refused(
        "{\"lights\":[{\"type\":\"area\"}]}", PEN_INVALID, "/lights/0/type", "rect, disk, sphere");
    refused("{\"lights\":[{\"type\":4}]}", PEN_INVALID, "/lights/0/type", "string");
    refused("{\"lights\":[{\"texture\":{\"pattern\":\"chequer\"}}]}", PEN_INVALID,
        "/lights/0/texture/pattern", "checker");
    refused("{\"lights\":[{\"texture\":{\"image\":\"abc\"}}]}", PEN_INVALID,
        "/lights/0/texture/image", "64 lower-case");
}

/* Both sides of every range, from the rows. `frame` has one %s for the value. */
static uint32_t rows_out_of_range(
    struct pen_param_table table, const char *frame, const char *pointer, uint32_t applies)
{
    uint32_t tried = 0;
    for (uint32_t r = 0; r < table.count; r++) {
        const struct pen_param *row = &table.rows[r];
        if (row->choices || row->type == PEN_PARAM_FLAG || row->type == PEN_PARAM_TEXT ||
            (applies && row->applies && !(row->applies & applies)))
            continue;
        double steps[] = {row->min - fmax(1, fabs(row->min)) * 0.01 - !pen_param_is_real(row),
            row->max + fmax(1, fabs(row->max)) * 0.01 + !pen_param_is_real(row), -INFINITY,
            INFINITY, 1.5, row->min};
        for (int side = 0; side < 6; side++) {
            bool fraction = side == 4, lowest = side == 5;
            if ((fraction && pen_param_is_real(row)) || (lowest && !row->exclusive_min))
                continue;
            char number[40], value[200] = "", member[320], text[512], at[128];
            snprintf(number, sizeof number, "%.9g",
                fraction || lowest                    ? steps[side]
                : !pen_param_is_real(row) && side < 2 ? floor(steps[side])
                                                      : steps[side]);
            if (isinf(steps[side]))
                strcpy(number, steps[side] < 0 ? "-1e999" : "1e999");
            if (row->count > 1)
                strcat(value, "[");
            for (uint32_t i = 0; i < row->count; i++) {
                strcat(value, i ? "," : "");
                strcat(value, number);
            }
            if (row->count > 1)
                strcat(value, "]");
            snprintf(member, sizeof member, "\"%s\":%s", row->name, value);
            snprintf(text, sizeof text, frame, member);
            snprintf(at, sizeof at, "%s/%s", pointer, row->name);
            refused(text, PEN_INVALID, at,
                side == 2 || side == 3 ? "finite"
                : fraction             ? "whole"
                                       : "must lie in");
            tried++;
        }
    }
    return tried;
}

static void test_ranges(void)
{
    CHECK(rows_out_of_range(pen_request_table(), "{%s}", "", 0) > 20);
    CHECK(rows_out_of_range(pen_delivery_table(), "{%s}", "", 0) >= 4);
    CHECK(rows_out_of_range(pen_output_table(), "{\"output\":{%s}}", "/output", 0) >= 8);
    struct pen_param_table camera = pen_camera_table();
    struct pen_param_table index = {camera.rows, 1}, look_at = {camera.rows + 1, 4},
                           orbit = {camera.rows + 5, camera.count - 5};
    rows_out_of_range(index, "{\"camera\":{%s}}", "/camera", 0);
    /* A second "eye" would be a repeated key: the first row is tried alone. */
    rows_out_of_range((struct pen_param_table){look_at.rows, 1}, "{\"camera\":{%s}}", "/camera", 0);
    rows_out_of_range((struct pen_param_table){look_at.rows + 1, 3},
        "{\"camera\":{\"eye\":[1,1,1],%s}}", "/camera", 0);
    CHECK(rows_out_of_range(orbit, "{\"camera\":{\"orbit\":{%s}}}", "/camera/orbit", 0) >= 12);
    for (uint32_t type = 0; type < PEN_LIGHT_TYPES; type++) {
        char frame[80];
        snprintf(frame, sizeof frame, "{\"lights\":[{\"type\":\"%s\",%%s}]}",
            pen_light_type_names[type]);
        CHECK(rows_out_of_range(pen_light_table(), frame, "/lights/0", PEN_LIGHT_BIT(type)) > 12);
    }
    CHECK(rows_out_of_range(fake_catalogue.items[2]->params, "{\"technique\":{\"params\":{%s}}}",
              "/technique/params", 0) > 14);

    /* 10^9 pixels, by one side and by both. */
    refused("{\"width\":1000000000,\"height\":1}", PEN_INVALID, "/width", "must lie in");
    refused("{\"width\":31623,\"height\":31623}", PEN_INVALID, "/width", "must lie in");
    refused("{\"width\":8192,\"height\":8192}", PEN_INVALID, "/width", "pixels");
    CHECK(parse("{\"width\":4096,\"height\":4096}"));
    refused("{\"width\":4097,\"height\":4096}", PEN_INVALID, "/width", "pixels");
    refused("{\"width\":99999999999999999999,\"height\":1}", PEN_INVALID, "/width", "must lie in");
    /* What no single row can say. */
    refused("{\"camera\":{\"eye\":[1,2,3],\"target\":[1,2,3]}}", PEN_INVALID, "/camera", "differ");
    refused("{\"camera\":{\"eye\":[1,2,3],\"up\":[0,0,0]}}", PEN_INVALID, "/camera", "up");
    refused("{\"output\":{\"layer\":\"all\"}}", PEN_INVALID, "/output/layer", "exr");
    refused("{\"output\":{\"bit_depth\":7}}", PEN_INVALID, "/output/bit_depth", "png");
    refused("{\"lights\":[{\"type\":\"spot\",\"inner_cone_deg\":50}]}", PEN_INVALID, "/lights/0",
        "inner");
}

static void test_bodies(void)
{
    static char big[PEN_MAX_JSON_BYTES + 2];
    refused("", PEN_MALFORMED, "", "empty");
    refused("{", PEN_MALFORMED, "", "byte 1");
    refused("{\"width\":}", PEN_MALFORMED, "", "byte 9");
    refused("{\"width\":NaN}", PEN_MALFORMED, "", "byte 9");
    refused("{\"width\":Infinity}", PEN_MALFORMED, "", "byte 9");
    refused("{\"width\":1}x", PEN_MALFORMED, "", "byte 11");
    refused("{\"width\\u0000\":1}", PEN_MALFORMED, "", "NUL");
    /* 64 KiB is the limit, to the byte. */
    memset(big, ' ', sizeof big);
    big[0] = '{';
    big[PEN_MAX_JSON_BYTES - 1] = '}';
    error = (struct pen_error){0};
    CHECK(pen_request_from_json(big, PEN_MAX_JSON_BYTES, &fake_catalogue, &request, &error));
    error = (struct pen_error){0};
    CHECK(!pen_request_from_json(big, PEN_MAX_JSON_BYTES + 1, &fake_catalogue, &request, &error));
    CHECK(error.code == PEN_TOO_BIG);
    /* The text needs no NUL behind it. */
    error = (struct pen_error){0};
    CHECK(pen_request_from_json("{\"width\":123}", 13, &fake_catalogue, &request, &error));
    error = (struct pen_error){0};
    CHECK(!pen_request_from_json("{\"width\":123}", 12, &fake_catalogue, &request, &error));
    CHECK(error.code == PEN_MALFORMED);
    /* Nesting: 32 is read (and refused for what it says), 33 is not. */
    for (int depth = 32; depth <= 33; depth++) {
        char text[128] = "{\"width\":";
        size_t at = strlen(text);
        memset(text + at, '[', (size_t)depth - 1);
        memset(text + at + depth - 1, ']', (size_t)depth - 1);
        strcpy(text + at + 2 * (depth - 1), "}");
        if (depth == 32)
            refused(text, PEN_INVALID, "/width", "number");
        else
            refused(text, PEN_MALFORMED, "", "nested more than 32");
    }
    memset(big, '[', 60000);
    error = (struct pen_error){0};
    CHECK(!pen_request_from_json(big, 60000, &fake_catalogue, &request, &error));
    CHECK(error.code == PEN_MALFORMED);
}

int main(void)
{
    test_defaults();
    test_values();
    test_keys();
    test_types();
    test_ranges();
    test_bodies();
    CHECK_DONE();
}
