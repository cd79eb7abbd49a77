#include "protocol/routes.h"
#include <stdio.h>
#include <string.h>

#define ROUTE(name, ...) [PEN_ROUTE_##name] = {.id = PEN_ROUTE_##name, __VA_ARGS__}
const struct pen_route pen_routes[PEN_ROUTES] = {
    ROUTE(SERVICE, "GET", "/v1", "getService", "Version, device, limits and links",
        .gives = PEN_BODY_SERVICE),
    ROUTE(
        OPENAPI, "GET", "/openapi.json", "getOpenapi", "This document", .gives = PEN_BODY_OPENAPI),
    ROUTE(TECHNIQUES, "GET", "/v1/techniques", "listTechniques",
        "Every shadow method with its parameters", .gives = PEN_BODY_TECHNIQUES),
    ROUTE(TECHNIQUE, "GET", "/v1/techniques/{name}", "getTechnique", "One shadow method",
        .gives = PEN_BODY_TECHNIQUE),
    ROUTE(SCENES, "GET", "/v1/scenes", "listScenes", "The stored scenes", .gives = PEN_BODY_SCENES,
        .flags = PEN_ROUTE_PAGED),
    ROUTE(SCENE_POST, "POST", "/v1/scenes", "uploadScene", "Upload a scene",
        .takes = PEN_BODY_SCENE_UPLOAD, .gives = PEN_BODY_SCENE, .flags = PEN_ROUTE_CREATES),
    ROUTE(
        SCENE, "GET", "/v1/scenes/{id}", "getScene", "What a scene holds", .gives = PEN_BODY_SCENE),
    ROUTE(SCENE_PUT, "PUT", "/v1/scenes/{id}", "putScene",
        "Upload a scene under the SHA-256 of its bytes", .takes = PEN_BODY_SCENE_UPLOAD,
        .gives = PEN_BODY_SCENE, .flags = PEN_ROUTE_CREATES),
    ROUTE(SCENE_DELETE, "DELETE", "/v1/scenes/{id}", "deleteScene", "Remove a scene"),
    ROUTE(RENDER, "GET", "/v1/scenes/{id}/render", "renderSceneByQuery",
        "Render a scene as the query string asks", .gives = PEN_BODY_IMAGE,
        .flags = PEN_ROUTE_QUERY | PEN_ROUTE_CONDITIONAL),
    ROUTE(RENDER_POST, "POST", "/v1/scenes/{id}/render", "renderScene", "Render a scene",
        .takes = PEN_BODY_REQUEST, .gives = PEN_BODY_IMAGE),
    ROUTE(COMPARE, "POST", "/v1/scenes/{id}/compare", "compareMethods",
        "How far methods are from a reference, and what they cost", .takes = PEN_BODY_COMPARE,
        .gives = PEN_BODY_COMPARISON),
    ROUTE(IMAGES, "GET", "/v1/images", "listImages", "The stored emission images",
        .gives = PEN_BODY_IMAGES, .flags = PEN_ROUTE_PAGED),
    ROUTE(IMAGE_POST, "POST", "/v1/images", "uploadImage", "Upload an emission image for a light",
        .takes = PEN_BODY_IMAGE_UPLOAD, .gives = PEN_BODY_IMAGE_INFO, .flags = PEN_ROUTE_CREATES),
    ROUTE(IMAGE, "GET", "/v1/images/{id}", "getImage", "What an emission image is",
        .gives = PEN_BODY_IMAGE_INFO),
    ROUTE(IMAGE_PUT, "PUT", "/v1/images/{id}", "putImage",
        "Upload an emission image under the SHA-256 of its bytes", .takes = PEN_BODY_IMAGE_UPLOAD,
        .gives = PEN_BODY_IMAGE_INFO, .flags = PEN_ROUTE_CREATES),
    ROUTE(IMAGE_DELETE, "DELETE", "/v1/images/{id}", "deleteImage", "Remove an emission image"),
    ROUTE(STATS, "GET", "/v1/stats", "getStats", "Rolling timings per method and stage",
        .gives = PEN_BODY_STATS),
    ROUTE(RESULT, "GET", "/v1/results/{id}", "getResult",
        "A rendered image by its ETag, as long as it is kept", .gives = PEN_BODY_IMAGE,
        .flags = PEN_ROUTE_CONDITIONAL),
};

/* Copies a token that may stand for the placeholder. */
static bool capture(
    const char *placeholder, const char *token, size_t bytes, struct pen_route_match *match)
{
    if (!strncmp(placeholder, "{id}", 4)) {
        if (bytes != PEN_ID_HEX || strspn(token, "0123456789abcdef") < bytes)
            return false;
        memcpy(match->id, token, bytes);
        match->id[bytes] = 0;
        return true;
    }
    if (!bytes || bytes >= sizeof match->name ||
        strspn(token, "abcdefghijklmnopqrstuvwxyz0123456789-") < bytes)
        return false;
    memcpy(match->name, token, bytes);
    match->name[bytes] = 0;
    return true;
}

static bool fits(const char *pattern, const char *path, struct pen_route_match *match)
{
    while (*pattern && *path) {
        if (*pattern == '{') {
            size_t bytes = strcspn(path, "/");
            if (!capture(pattern, path, bytes, match))
                return false;
            path += bytes;
            pattern = strchr(pattern, '}') + 1;
        } else if (*pattern++ != *path++)
            return false;
    }
    return !*pattern && !*path;
}

bool pen_route_find(const char *method, const char *path, struct pen_route_match *match)
{
    memset(match, 0, sizeof *match);
    if (!strcmp(method, "HEAD"))
        method = "GET";
    for (uint32_t r = 0; r < PEN_ROUTES; r++) {
        if (!fits(pen_routes[r].pattern, path, match))
            continue;
        match->methods |= 1u << r;
        if (!strcmp(pen_routes[r].method, method))
            match->route = &pen_routes[r];
    }
    return match->route != NULL;
}

void pen_route_allow(uint32_t methods, char *text, uint32_t bytes)
{
    text[0] = 0;
    for (uint32_t r = 0, at = 0; r < PEN_ROUTES && at < bytes; r++)
        if (methods & 1u << r)
            at += (uint32_t)snprintf(text + at, bytes - at, "%s%s%s", at ? ", " : "",
                pen_routes[r].method, strcmp(pen_routes[r].method, "GET") ? "" : ", HEAD");
}
