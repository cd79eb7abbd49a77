/* Calls to the server through libcurl. */
#pragma once
#include "clients/cli/cli.h"

struct cli_part {     /* one file of a multipart upload */
    const char *name; /* relative, '/'-separated */
    const char *path; /* on this machine */
    const char *type; /* media type */
};

struct cli_call {
    const char *method, *path;
    const char *accept;       /* NULL: application/json */
    const char *content_type; /* of the body */
    const char *body;         /* text, or */
    FILE *file;               /* a file of file_bytes, read from its start, or */
    uint64_t file_bytes;
    const struct cli_part *parts; /* files as multipart/form-data */
    uint32_t part_count;
    FILE *sink;         /* takes the body of a 2xx answer; NULL: answer->text does */
    const char *doing;  /* "uploading x": shown on a terminal while it lasts */
    bool missing_is_ok; /* 404 is an answer like any other */
};

struct cli_answer {
    long status;
    char *text; /* NUL-terminated; NULL when empty or gone to the sink */
    size_t bytes;
    char type[96];        /* Content-Type */
    char location[512];   /* Location */
    char timing[512];     /* Server-Timing */
    char choice[320];     /* X-Penumbra-Choice: what "auto" took and why */
    char *warnings;       /* X-Penumbra-Warning, one a line; or NULL */
    double retry_after_s; /* negative: not said */
};

/* Calls, again after 429 and 503 as often as the server's settings say, and reports what went
 * wrong: the server's problem document in words. Returns an enum cli_exit. *answer is ended with
 * cli_answer_finish whatever is returned. */
int cli_call(
    const struct cli_server *server, const struct cli_call *call, struct cli_answer *answer);
void cli_answer_finish(struct cli_answer *answer);

/* The answer's text as a JSON object, or NULL after reporting that it is none. */
cJSON *cli_answer_object(const struct cli_answer *answer);
