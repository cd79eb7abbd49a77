#include "protocol/routes.h"
#include "protocol/request.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

const struct pen_route pen_routes[PEN_ROUTES] = {
#define ENDPOINT(id_, ...) [PEN_ROUTE_##id_] = {.id = PEN_ROUTE_##id_, __VA_ARGS__},
#include "protocol/endpoints.def"
};
_Static_assert(PEN_ROUTES <= 64, "struct pen_route_match has a bit for each");

const char *const *pen_upload_types(enum pen_body body)
{
    static const char *const scene[] = {"model/gltf-binary", "model/gltf+json", "application/zip",
        "application/x-zip-compressed", "application/json", "multipart/form-data",
        "application/octet-stream", NULL};
    static const char *const image[] = {"image/png", "image/jpeg", "image/webp",
        "multipart/form-data", "application/octet-stream", NULL};
    return body == PEN_BODY_SCENE_UPLOAD ? scene : body == PEN_BODY_IMAGE_UPLOAD ? image : NULL;
}

/* Copies a token that may stand for the placeholder. */
static bool capture(
    const char *placeholder, const char *token, size_t bytes, struct pen_route_match *match)
{
    if (!strncmp(placeholder, "{id}", 4)) {
        char text[PEN_ID_HEX + 1];
        if (bytes < PEN_ID_PREFIX || bytes > PEN_ID_HEX)
            return false;
        memset(text, '0', PEN_ID_HEX);
        text[PEN_ID_HEX] = 0;
        memcpy(text, token, bytes);
        match->id_digits = (uint32_t)bytes;
        return pen_id_from_hex(text, match->id);
    }
    if (!strncmp(placeholder, "{number}", 8)) {
        if (!bytes || bytes > 9 || strspn(token, "0123456789") < bytes ||
            (bytes > 1 && *token == '0'))
            return false;
        match->number = (uint32_t)strtoul(token, NULL, 10);
        return true;
    }
    const char *letters = !strncmp(placeholder, "{file}", 6)
                              ? "abcdefghijklmnopqrstuvwxyz0123456789-."
                              : "abcdefghijklmnopqrstuvwxyz0123456789-";
    if (!bytes || bytes >= sizeof match->name || strspn(token, letters) < bytes)
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

/* What stands behind the pattern of a PEN_ROUTE_NAMED row. */
static bool is_file_name(const char *path)
{
    static const char *const endings[] = {".glb", ".gltf", ".zip"};
    size_t bytes = strlen(path);
    for (size_t i = 0; i < sizeof endings / sizeof *endings; i++) {
        size_t tail = strlen(endings[i]);
        if (bytes > 1 + tail && !strcasecmp(path + bytes - tail, endings[i]))
            return path[0] == '/' && !strchr(path + 1, '/');
    }
    return false;
}

bool pen_route_find(const char *method, const char *path, struct pen_route_match *match)
{
    memset(match, 0, sizeof *match);
    if (!strcmp(method, "HEAD"))
        method = "GET";
    for (uint32_t r = 0; r < PEN_ROUTES; r++) {
        const struct pen_route *row = &pen_routes[r];
        size_t bytes = strlen(row->pattern);
        bool wanted = !strcmp(row->method, method);
        bool named = wanted && row->flags & PEN_ROUTE_NAMED &&
                     !strncmp(path, row->pattern, bytes) && is_file_name(path + bytes);
        if (!named && !fits(row->pattern, path, match))
            continue;
        match->methods |= 1ull << r;
        if (wanted)
            match->route = row;
    }
    return match->route != NULL;
}

void pen_route_allow(uint64_t methods, char *text, uint32_t bytes)
{
    text[0] = 0;
    for (uint32_t r = 0, at = 0; r < PEN_ROUTES && at < bytes; r++)
        if (methods & 1ull << r)
            at += (uint32_t)snprintf(text + at, bytes - at, "%s%s%s", at ? ", " : "",
                pen_routes[r].method, strcmp(pen_routes[r].method, "GET") ? "" : ", HEAD");
}
