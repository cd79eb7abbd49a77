/* The command-line client: what its commands share. Messages go to stderr, results to stdout. */
#pragma once
#include <cjson/cJSON.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

enum cli_exit {
    CLI_OK = 0,
    CLI_FAILED = 1,  /* on this side: a file that cannot be read or written */
    CLI_USAGE = 2,   /* the command line */
    CLI_REFUSED = 3, /* the server answered 4xx */
    CLI_SERVER = 4,  /* the server answered 5xx */
    CLI_NO_CONNECTION = 5,
};

/* Prints "penumbra: ..." and returns `code`. */
int cli_fail(int code, const char *format, ...) __attribute__((format(printf, 2, 3)));

/* The arguments of a command, read from left to right. */
struct cli_args {
    char **argv;
    int count, at;
    int status; /* CLI_OK until an argument was wrong (already reported) */
};
/* True when the current argument is --name, --name=value or --name value; then it is consumed and
 * *value holds the value. A missing value sets args->status. A name of one letter also fits -n. */
bool cli_option(struct cli_args *args, const char *name, const char **value);
/* The same without a value. */
bool cli_flag(struct cli_args *args, const char *name);
/* The current argument when it is not an option, consumed; else NULL. */
const char *cli_positional(struct cli_args *args);
/* Reports the current argument as unknown; `command` is named in the hint. */
int cli_unknown(const struct cli_args *args, const char *command);

/* Where and how to call. */
struct cli_server {
    char base[512]; /* no trailing slash */
    int retries;    /* after 429 and 503 */
    bool verbose;
};
void cli_server_init(struct cli_server *server);

/* True for 64 lower-case hexadecimal digits, an id; for as many as may stand for one, or all. */
bool cli_is_id(const char *text);
bool cli_is_prefix(const char *text);

/* Typed guess: true, false, a number, numbers joined by commas, else a string. */
cJSON *cli_guess(const char *text);
/* Allocation that ends the program when there is no memory. */
char *cli_format(const char *format, ...) __attribute__((format(printf, 1, 2)));
