/* What rendering and comparing share. */
#pragma once
#include "clients/cli/http.h"

#define CLI_ABOUT_SCENE                                                                            \
    "SCENE is a .glb, a .gltf with the files that it names, or a .zip of these; where a zip "      \
    "holds "                                                                                       \
    "several scenes, FILE.zip#ENTRY takes one. Or it is a stored scene: its id, the first digits " \
    "of it (six or more) that no other has, or its name."

/* Uploads the files that lights have as textures and puts their ids in their place. */
int cli_upload_textures(const struct cli_server *server, cJSON *root);
/* Calls and leaves the image in `path` ("-": standard output), which appears only when it is
 * complete. Prints warnings. */
int cli_save_image(const struct cli_server *server, struct cli_call *call, const char *path);
/* The same for what has a type that begins with `kind`; `word` says what that is. */
int cli_save(const struct cli_server *server, struct cli_call *call, const char *path,
    const char *kind, const char *word);
/* The format that the ending of `path` (NULL: there is none) stands for, unless the request names
 * one. Returns an enum cli_exit, as does: */
int cli_choose_format(const char *path, cJSON *root);
/* Renders a stored scene: prints the record, leaves the image in `output` (NULL: nowhere). */
int cli_render_scene(
    const struct cli_server *server, const char *id, cJSON *root, bool record, const char *output);
