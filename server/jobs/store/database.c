#include "server/jobs/store/database.h"
#include "protocol/memory.h"
#include "server/base/log.h"
#include <sqlite3.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define BUSY_MS 1000 /* how long another program's lock is waited for */
#define MOST_COLUMNS 24

struct database {
    sqlite3 *connection;
};

static bool fail(struct database *d, int code, struct pen_error *error)
{
    const char *why;
    enum pen_code told = PEN_UNAVAILABLE;
    switch (code & 0xff) {
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
        why = "is locked by another program";
        break;
    case SQLITE_READONLY:
    case SQLITE_PERM:
        why = "cannot be written to";
        break;
    case SQLITE_CORRUPT:
    case SQLITE_NOTADB:
        why = "is damaged: when its file is moved away a new one is made";
        break;
    case SQLITE_FULL:
        why = "has no room: the disk is full";
        told = PEN_FULL;
        break;
    case SQLITE_CANTOPEN:
        why = "cannot be opened";
        break;
    default:
        why = "cannot be used";
    }
    log_event(LOG_ERROR, "the jobs' database %s (%s)", why,
        d && d->connection ? sqlite3_errmsg(d->connection) : sqlite3_errstr(code));
    return pen_fail(error, told, "", "The jobs' database %s.", why);
}

static void see_check(void *context, const struct database_value *columns)
{
    bool *sound = context;
    *sound = columns[0].text && !strcmp(columns[0].text, "ok");
}

static struct database *connect(const char *path, int flags, struct pen_error *error)
{
    struct database *d = pen_alloc_zero(1, sizeof *d);
    int code = sqlite3_open_v2(path, &d->connection, flags | SQLITE_OPEN_NOMUTEX, NULL);
    if (code == SQLITE_OK) {
        sqlite3_busy_timeout(d->connection, BUSY_MS);
        return d;
    }
    fail(d, code, error);
    database_close(d);
    return NULL;
}

struct database *database_open(const char *path, struct pen_error *error)
{
    bool sound = false;
    struct database *d = connect(path, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE, error);
    /* FULL: an accepted job is not forgotten with the power. The write lock shows here, and not at the
     * first job, what cannot be written to. */
    bool ok = d && database_script(d, "PRAGMA journal_mode=WAL; PRAGMA synchronous=FULL;", error) &&
              database_run(d, "PRAGMA quick_check(1)", NULL, 0, see_check, &sound, error) &&
              (sound || fail(d, SQLITE_CORRUPT, error)) &&
              database_script(d, "BEGIN IMMEDIATE; PRAGMA user_version=1; COMMIT;", error);
    if (ok)
        return d;
    database_close(d);
    return NULL;
}

struct database *database_open_reader(const char *path, struct pen_error *error)
{
    return connect(path, SQLITE_OPEN_READWRITE, error);
}

void database_close(struct database *d)
{
    if (!d)
        return;
    sqlite3_close_v2(d->connection);
    free(d);
}

static void bind(sqlite3_stmt *statement, const struct database_value *values, uint32_t count)
{
    for (uint32_t i = 0; i < count; i++) {
        char name[12];
        snprintf(name, sizeof name, "$%u", i + 1);
        int at = sqlite3_bind_parameter_index(statement, name); /* 0, not used: refused quietly */
        if (values[i].text)
            sqlite3_bind_text(statement, at, values[i].text, -1, SQLITE_STATIC);
        else
            sqlite3_bind_int64(statement, at, values[i].number);
    }
}

static void give_row(sqlite3_stmt *statement, database_row *row, void *context)
{
    struct database_value columns[MOST_COLUMNS] = {0};
    int count = sqlite3_column_count(statement);
    for (int i = 0; i < count && i < MOST_COLUMNS; i++)
        if (sqlite3_column_type(statement, i) == SQLITE_INTEGER)
            columns[i].number = sqlite3_column_int64(statement, i);
        else
            columns[i].text = (const char *)sqlite3_column_text(statement, i);
    row(context, columns);
}

bool database_run(struct database *d, const char *sql, const struct database_value *values,
    uint32_t count, database_row *row, void *context, struct pen_error *error)
{
    sqlite3_stmt *statement = NULL;
    int code = sqlite3_prepare_v2(d->connection, sql, -1, &statement, NULL);
    if (code == SQLITE_OK)
        bind(statement, values, count);
    while (code == SQLITE_OK || code == SQLITE_ROW) {
        code = sqlite3_step(statement);
        if (code == SQLITE_ROW && row)
            give_row(statement, row, context);
    }
    bool ok = code == SQLITE_DONE || fail(d, code, error);
    sqlite3_finalize(statement);
    return ok;
}

bool database_script(struct database *d, const char *sql, struct pen_error *error)
{
    int code = sqlite3_exec(d->connection, sql, NULL, NULL, NULL);
    return code == SQLITE_OK || fail(d, code, error);
}

bool database_begin(struct database *d, struct pen_error *error)
{
    return database_script(d, "BEGIN IMMEDIATE", error);
}

bool database_end(struct database *d, bool ok, struct pen_error *error)
{
    if (ok && database_script(d, "COMMIT", error))
        return true;
    if (!sqlite3_get_autocommit(d->connection)) /* some failures have taken it back already */
        sqlite3_exec(d->connection, "ROLLBACK", NULL, NULL, NULL);
    return false;
}
