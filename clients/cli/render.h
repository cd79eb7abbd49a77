/* What rendering and comparing share. */
#pragma once
#include "clients/cli/http.h"

/* Uploads the files that lights have as textures and puts their ids in their place. */
int cli_upload_textures(const struct cli_server *server, cJSON *root);
/* Calls and leaves the image in `path` ("-": standard output), which appears only when it is
 * complete. Prints warnings. */
int cli_save_image(const struct cli_server *server, struct cli_call *call, const char *path);
/* The same for what has a type that begins with `kind`; `word` says what that is. */
int cli_save(const struct cli_server *server, struct cli_call *call, const char *path,
    const char *kind, const char *word);
