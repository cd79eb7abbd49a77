/* Pictures that get better, as they come in a multipart/x-mixed-replace. */
#pragma once
#include "clients/cli/http.h"

/* Calls, and puts each picture in the place of the one before, so that whoever looks at the file sees
 * it getting better; to standard output ("-") goes the last one alone. *answer is ended with
 * cli_answer_finish whatever is returned. */
int cli_save_parts(const struct cli_server *server, struct cli_call *call, const char *path,
    struct cli_answer *answer);
