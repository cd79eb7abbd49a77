/* Lists of the server and what is in them. */
#pragma once
#include "clients/cli/http.h"

/* A member, 0 or "" where it is missing. */
double cli_number(const cJSON *object, const char *key);
const char *cli_text(const cJSON *object, const char *key);

/* Prints all pages of the list at `path`, whose items are under `key`: as JSON, or each by `print`. */
int cli_list(const struct cli_server *server, const char *path, const char *key, bool json,
    void (*print)(const cJSON *item));
/* Calls `method` for what has this id, or one that begins so, under `folder`, and prints the answer if it is JSON. */
int cli_with_id(
    const struct cli_server *server, const char *method, const char *folder, const char *id);
