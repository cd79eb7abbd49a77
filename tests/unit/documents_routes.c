/* Routing by exact tokens. */
#include "protocol/request.h"
#include "protocol/routes.h"
#include "tests/unit/check.h"

#define ID "0123456789abcdef0123456789abcdef0123456789abcdef0123456789abcdef"

static void check_id(const struct pen_route_match *match)
{
    char text[PEN_ID_HEX + 1];
    pen_id_to_hex(match->id, text);
    CHECK_STR(text, ID);
}

int main(void)
{
    struct pen_route_match match;
    char allow[64];
    for (uint32_t r = 0; r < PEN_ROUTES; r++) {
        CHECK(pen_routes[r].id == r && pen_routes[r].method && pen_routes[r].operation);
        for (uint32_t other = 0; other < r; other++)
            CHECK(strcmp(pen_routes[r].operation, pen_routes[other].operation));
    }
    CHECK(pen_route_find("GET", "/v1", &match) && match.route->id == PEN_ROUTE_service);
    CHECK(pen_route_find("HEAD", "/v1/scenes", &match) && match.route->id == PEN_ROUTE_scenes);
    CHECK(pen_route_find("POST", "/v1/scenes", &match) && match.route->id == PEN_ROUTE_scene_post);
    CHECK(pen_route_find("PUT", "/v1/scenes/" ID, &match));
    CHECK(match.route->id == PEN_ROUTE_scene_put);
    check_id(&match);
    CHECK(pen_route_find("GET", "/v1/scenes/" ID "/render", &match));
    CHECK(match.route->id == PEN_ROUTE_render_query);
    check_id(&match);
    CHECK(pen_route_find("GET", "/v1/techniques/pcss", &match));
    CHECK(match.route->id == PEN_ROUTE_technique);
    CHECK_STR(match.name, "pcss");
    CHECK(pen_route_find("DELETE", "/v1/images/" ID, &match));
    CHECK(match.route->id == PEN_ROUTE_image_delete);
    static const char *const nowhere[] = {"", "v1", "/v1/", "//v1", "/v1//scenes", "/V1",
        "/v1/scenes/", "/v1/scenes/" ID "/", "/v1/scenes/" ID "0", "/v1/scenes/abc",
        "/v1/scenes/../techniques", "/v1/./scenes", "/v1/scenes/" ID "/render/x",
        "/v1/scenes//render", "/v1/techniques/", "/v1/techniques/a/b", "/v1/techniques/..",
        "/v1/techniques/PCSS", "/v1/scenesx", "/v1/scenes?x",
        "/v1/scenes/0123456789ABCDEF0123456789abcdef0123456789abcdef0123456789abcdef",
        "/v1/techniques/aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa"};
    for (size_t i = 0; i < sizeof nowhere / sizeof *nowhere; i++) {
        bool found = pen_route_find("GET", nowhere[i], &match);
        if (found || match.methods)
            fprintf(stderr, "found: %s\n", nowhere[i]), check_failures++;
    }
    CHECK(pen_route_find("GET", "/v1/scenes/" ID, &match) && match.id_digits == PEN_ID_HEX);
    CHECK(pen_route_find("GET", "/v1/scenes/0123456", &match) && match.id_digits == 7);
    CHECK(match.id[0] == 0x01 && match.id[2] == 0x45 && match.id[3] == 0x60 && !match.id[31]);
    CHECK(!pen_route_find("GET", "/v1/scenes/01234", &match));
    CHECK(!pen_route_find("POST", "/v1/scenes/" ID, &match) && match.methods);
    pen_route_allow(match.methods, allow, sizeof allow);
    CHECK_STR(allow, "GET, HEAD, PUT, PATCH, DELETE");
    CHECK(!pen_route_find("DELETE", "/v1/scenes", &match) && match.methods);
    pen_route_allow(match.methods, allow, sizeof allow);
    CHECK_STR(allow, "GET, HEAD, POST, PUT");
    /* curl -T file URL/ puts the file's name behind */
    CHECK(pen_route_find("PUT", "/v1/scenes/My scene.GLB", &match));
    CHECK(match.route->id == PEN_ROUTE_scene_send);
    CHECK(pen_route_find("PUT", "/v1/scenes", &match) && match.route->id == PEN_ROUTE_scene_send);
    CHECK(!pen_route_find("GET", "/v1/scenes/a.glb", &match) && !match.methods);
    CHECK(!pen_route_find("PUT", "/v1/scenes/.glb", &match) && !match.methods);
    CHECK(!pen_route_find("PUT", "/v1/scenes/a.png", &match) && !match.methods);
    CHECK(!pen_route_find("PUT", "/v1/scenes/a.glb/b", &match) && !match.methods);
    CHECK_DONE();
}
