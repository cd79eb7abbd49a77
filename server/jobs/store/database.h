/* A SQL database as the jobs need it: one function that runs a statement. The statements are written
 * so that PostgreSQL takes them too: parameters are $1, $2, in that order. Not thread-safe. */
#pragma once
#include "protocol/error.h"

/* A parameter or a column: a text, or a number where `text` is NULL. */
struct database_value {
    const char *text;
    int64_t number;
};

struct database;
/* Opens or makes the SQLite database in this file, in WAL mode, and checks it. Errors, as of every
 * function here: PEN_UNAVAILABLE, saying whether it is locked, damaged or read-only, and PEN_FULL. */
struct database *database_open(const char *path, struct pen_error *error);
/* A second connection to one that is open: what it reads waits for no writer. */
struct database *database_open_reader(const char *path, struct pen_error *error);
void database_close(struct database *database); /* NULL is fine */

/* Runs one statement and calls `row` (which may be NULL) for each row of the answer; texts hold for
 * the call. */
typedef void database_row(void *context, const struct database_value *columns);
bool database_run(struct database *database, const char *sql, const struct database_value *values,
    uint32_t count, database_row *row, void *context, struct pen_error *error);
/* Several statements in one, with no parameters. */
bool database_script(struct database *database, const char *sql, struct pen_error *error);

/* What is run between the two is there as a whole or not at all, and after a commit stays whatever
 * happens to the machine. A commit that fails, and one with ok false, takes it back. */
bool database_begin(struct database *database, struct pen_error *error);
bool database_end(struct database *database, bool ok, struct pen_error *error);
