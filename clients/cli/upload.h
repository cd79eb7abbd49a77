/* Scenes and emission images to the server, each only once. */
#pragma once
#include "clients/cli/http.h"
#include "protocol/limits.h"

/* Makes sure that the server has the scene and fills `id`. `scene` is a file (.glb, .zip,
 * "x.zip#entry" or a .gltf, which is sent with the files it names) or already an id. `described`, when not NULL,
 * receives the server's description (free with cJSON_Delete). Returns an enum cli_exit. */
int cli_upload_scene(
    const struct cli_server *server, const char *scene, char id[PEN_ID_HEX + 1], cJSON **described);
/* The same for an emission image: PNG, JPEG or WebP. */
int cli_upload_image(const struct cli_server *server, const char *path, char id[PEN_ID_HEX + 1]);

/* True for 64 lower-case hexadecimal digits. */
bool cli_is_id(const char *text);
