/* Query strings mean the same as JSON bodies. */
#include "protocol/json_request.h"
#include "tests/unit/check.h"
#include "tests/unit/documents_catalogue.h"

static struct pen_request request;
static struct pen_error error;

/* "a=1&b=2", split at '&' and the first '='. */
static bool query(const char *text)
{
    static char copy[8192];
    struct pen_query_pair pairs[300];
    uint32_t count = 0;
    snprintf(copy, sizeof copy, "%s", text);
    for (char *at = *copy ? copy : NULL; at;) {
        char *next = strchr(at, '&');
        if (next)
            *next++ = 0;
        char *equals = strchr(at, '=');
        if (equals)
            *equals++ = 0;
        pairs[count++] = (struct pen_query_pair){at, equals};
        at = next;
    }
    error = (struct pen_error){0};
    return pen_request_from_query(pairs, count, &fake_catalogue, &request, &error);
}

static void same(const char *text, const char *json)
{
    struct pen_request expected;
    struct pen_error e = {0};
    CHECK(pen_request_from_json(json, strlen(json), &fake_catalogue, &expected, &e));
    if (!query(text))
        fprintf(stderr, "%s: %u %s %s\n", text, error.code, error.pointer, error.message),
            check_failures++;
    else if (memcmp(&expected, &request, sizeof request))
        fprintf(stderr, "%s is not %s\n", text, json), check_failures++;
}

static void refused(const char *text, uint32_t code, const char *pointer, const char *message)
{
    if (!query(text) && error.code == code && !strcmp(error.pointer, pointer) &&
        strstr(error.message, message))
        return;
    fprintf(stderr, "%s\n  gave %u \"%s\": %s\n  expected %u \"%s\": %s\n", text, error.code,
        error.pointer, error.message, code, pointer, message);
    check_failures++;
}

int main(void)
{
    same("", "{}");
    same("technique=pcss&width=320&params.search_taps=32",
        "{\"technique\":{\"name\":\"pcss\",\"params\":{\"search_taps\":32}},\"width\":320}");
    same("search_taps=32&tint=0,1,0.5&mode=plain&rotate=off&bias=0.05&offset=-3",
        "{\"technique\":{\"params\":{\"search_taps\":32,\"tint\":[0,1,0.5],\"mode\":\"plain\","
        "\"rotate\":false,\"bias\":0.05,\"offset\":-3}}}");
    same("technique.name=hard&technique.params.width=0.25&width=64",
        "{\"technique\":{\"name\":\"hard\",\"params\":{\"width\":0.25}},\"width\":64}");
    /* A key of the request goes before a parameter of the same name. */
    same("technique=hard&width=64", "{\"technique\":\"hard\",\"width\":64}");
    same("camera.eye=2,1,3&camera.target=0,0.5,0&camera.fov_y_deg=30",
        "{\"camera\":{\"eye\":[2,1,3],\"target\":[0,0.5,0],\"fov_y_deg\":30}}");
    same("camera.orbit.azimuth_deg=30&camera.orbit.distance=2.5",
        "{\"camera\":{\"orbit\":{\"azimuth_deg\":30,\"distance\":2.5}}}");
    same("camera.index=0", "{\"camera\":{\"index\":0}}");
    same("light.type=rect&light.position=1.5,3,1&light.texture.pattern=checker&light.radiance=5",
        "{\"lights\":[{\"type\":\"rect\",\"position\":[1.5,3,1],\"radiance\":5,"
        "\"texture\":{\"pattern\":\"checker\"}}]}");
    same("lights.1.type=sun&lights.0.type=sphere&lights.0.radius=0.1&lights.1.irradiance=2",
        "{\"lights\":[{\"type\":\"sphere\",\"radius\":0.1},{\"type\":\"sun\",\"irradiance\":2}]}");
    same("lights=none", "{\"lights\":[]}");
    same("format=exr&layer=depth&bit_depth=32&quality=50",
        "{\"output\":{\"format\":\"exr\",\"layer\":\"depth\",\"bit_depth\":32,\"quality\":50}}");
    same("output.format=jpeg&ground=false&tone_map=aces&ambient=0,0,0&priority=batch",
        "{\"output\":{\"format\":\"jpeg\"},\"ground\":false,\"tone_map\":\"aces\","
        "\"ambient\":[0,0,0],\"priority\":\"batch\"}");
    same("request={\"width\":77,\"lights\":[]}", "{\"width\":77,\"lights\":[]}");

    refused("widht=1", PEN_INVALID, "/widht", "did you mean \"width\"");
    refused("technique=hard&search_taps=3", PEN_INVALID, "/search_taps", "There is no key");
    refused(
        "search_taps=3&technique=vsm", PEN_INVALID, "/technique/name", "no method called \"vsm\"");
    refused("technique=", PEN_INVALID, "/technique/name", "no method");
    refused("width=1&width=1", PEN_INVALID, "", "given twice");
    refused("width=1&width=2", PEN_INVALID, "", "given twice");
    refused("layer=depth&output.layer=depth", PEN_INVALID, "", "given twice");
    refused("light.type=rect&lights.0.type=rect", PEN_INVALID, "", "given twice");
    refused("search_taps=1&params.search_taps=1", PEN_INVALID, "", "given twice");
    refused("technique=pcss&technique.name=pcss", PEN_INVALID, "", "given twice");
    refused("camera=1&camera.index=1", PEN_INVALID, "", "given twice");
    refused("camera.index=1&camera=1", PEN_INVALID, "", "given twice");
    refused("camera=1", PEN_INVALID, "/camera", "object");
    refused("width", PEN_INVALID, "/width", "1 number");
    refused("width=", PEN_INVALID, "/width", "1 number");
    refused("width=1.5", PEN_INVALID, "/width", "whole");
    refused("width=0x10", PEN_INVALID, "/width", "1 number");
    refused("width=nan", PEN_INVALID, "/width", "1 number");
    refused("exposure_ev=inf", PEN_INVALID, "/exposure_ev", "1 number");
    refused("exposure_ev=1e999", PEN_INVALID, "/exposure_ev", "finite");
    refused("width=%201", PEN_INVALID, "/width", "1 number");
    refused("width=0", PEN_INVALID, "/width", "must lie in");
    refused("width=8193", PEN_INVALID, "/width", "must lie in");
    refused("ground=maybe", PEN_INVALID, "/ground", "true, false or shadow");
    refused("tone_map=filmic", PEN_INVALID, "/tone_map", "none, reinhard, aces");
    refused("ambient=1,2", PEN_INVALID, "/ambient", "3 numbers");
    refused("ambient=1,2,3,4", PEN_INVALID, "/ambient", "3 numbers");
    refused("camera.eye=1,1,1&camera.orbit.distance=2", PEN_INVALID, "/camera/eye", "exclude");
    refused("light.type=sun&light.radius=1", PEN_INVALID, "/lights/0/radius",
        "sun light has no radius");
    refused("lights.1.type=rect", PEN_INVALID, "/lights", "but not 0");
    refused("lights.0.type=rect&lights.2.type=rect", PEN_INVALID, "/lights", "but not 1");
    refused("lights.x.type=rect", PEN_INVALID, "/lights", "but not 0");
    refused("lights.00.type=rect", PEN_INVALID, "/lights", "but not 0");
    refused("lights=all", PEN_INVALID, "/lights", "none");
    refused("lights.0=rect", PEN_INVALID, "/lights/0", "object");
    refused("width.x=1", PEN_INVALID, "/width", "number");
    refused(".=1", PEN_INVALID, "", "no query key");
    refused("=1", PEN_INVALID, "", "no query key");
    refused("camera.=1", PEN_INVALID, "", "no query key");
    refused("camera..eye=1", PEN_INVALID, "", "no query key");
    refused("a.b.c.d.e.f.g=1", PEN_INVALID, "", "no query key");
    refused("request={}&width=1", PEN_INVALID, "", "excludes");
    refused("request={", PEN_MALFORMED, "", "byte 1");
    refused("request=", PEN_MALFORMED, "", "empty");
    refused("camera.eye=1,2,3&camera.target=1,2,3", PEN_INVALID, "/camera", "differ");

    /* A text that is no UTF-8 could not be written down and read back. */
    static const char *const ill_formed[] = {"\x8d", "a\xc3", "\xc0\x80", "\xe0\x80\x80",
        "\xed\xa0\x80", "\xf0\x8f\xbf\xbf", "\xf4\x90\x80\x80", "\xff", "\xc3("};
    for (size_t i = 0; i < sizeof ill_formed / sizeof *ill_formed; i++) {
        char query[80];
        snprintf(query, sizeof query, "session=%s", ill_formed[i]);
        refused(query, PEN_MALFORMED, "", "not UTF-8");
        snprintf(query, sizeof query, "%s=1", ill_formed[i]);
        refused(query, PEN_MALFORMED, "", "not UTF-8");
    }

    char many[4000] = "a0=1";
    for (int i = 1; i < 290; i++)
        snprintf(many + strlen(many), sizeof many - strlen(many), "&a%d=1", i);
    refused(many, PEN_MALFORMED, "", "at most 256");
    char text[600];
    memset(text, 'k', sizeof text);
    strcpy(text + 500, "=1");
    refused(text, PEN_INVALID, "", "no query key");
    CHECK_DONE();
}
