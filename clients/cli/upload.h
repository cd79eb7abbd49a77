/* Scenes and emission images to the server, each only once. */
#pragma once
#include "clients/cli/http.h"
#include "protocol/limits.h"

struct cli_stored {
    cJSON *description; /* the server's, or NULL; to be freed */
    bool sent;          /* the server did not have it */
};
/* Makes sure that the server has the scene and fills `id`. `scene` is a file (.glb, .zip,
 * "x.zip#entry" or a .gltf, which is sent with the files it names) or what is stored already: see cli_find_scene. Returns an
 * enum cli_exit. `stored` may be NULL. */
int cli_upload_scene(const struct cli_server *server, const char *scene, char id[PEN_ID_HEX + 1],
    struct cli_stored *stored);
/* The same for an emission image: PNG, JPEG or WebP. */
int cli_upload_image(const struct cli_server *server, const char *path, char id[PEN_ID_HEX + 1]);
