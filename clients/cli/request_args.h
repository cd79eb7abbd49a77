/* A render request from command-line flags. */
#pragma once
#include "clients/cli/rows/rows.h"

/* Consumes one flag that shapes the request: --technique, --set, --light, --json and one per
 * parameter row. `root` is the request body so far. */
bool cli_request_option(struct cli_args *args, cJSON *root);
/* The same, and what only sequences have. */
bool cli_sequence_option(struct cli_args *args, cJSON *root);
/* True when the body has `key`, at the top or inside the object `group`. */
bool cli_request_has(const cJSON *root, const char *group, const char *key);
/* Every flag of the two, as it is shown. */
void cli_each_request_row(bool sequence, cli_show *show, void *context);
/* Keys of --light, in the same form: name and help. */
void cli_each_light_key(cli_show *show, void *context);
