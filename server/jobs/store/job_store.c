#include "server/jobs/store/job_store.h"
#include "protocol/memory.h"
#include "protocol/request.h"
#include "server/jobs/store/database.h"
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define MOST_KEYS 1000 /* of one client */

const char *const job_kind_names[] = {"render", "compare", "sequence", NULL};
const char *const job_state_names[] = {
    "accepted", "running", "successful", "failed", "dismissed", NULL};

struct job_store {
    pthread_mutex_t lock; /* guards the database */
    struct database *database;
    pthread_mutex_t read_lock; /* guards the reader: who reads waits for no disk */
    struct database *reader;
};

static const char schema[] =
    "CREATE TABLE IF NOT EXISTS jobs (id TEXT PRIMARY KEY, scene TEXT NOT NULL,"
    " client BIGINT NOT NULL, kind BIGINT NOT NULL, state BIGINT NOT NULL, frames BIGINT NOT NULL,"
    " done BIGINT NOT NULL, bytes BIGINT NOT NULL, seq BIGINT NOT NULL, state_seq BIGINT NOT NULL,"
    " created BIGINT NOT NULL, ended BIGINT NOT NULL, expires BIGINT NOT NULL,"
    " settings TEXT NOT NULL, result_bytes BIGINT NOT NULL, result_tag TEXT NOT NULL,"
    " result_name TEXT NOT NULL, error_code BIGINT NOT NULL, error_pointer TEXT NOT NULL,"
    " error_message TEXT NOT NULL, body TEXT NOT NULL);"
    "CREATE INDEX IF NOT EXISTS jobs_states ON jobs (state, client);"
    "CREATE INDEX IF NOT EXISTS jobs_ends ON jobs (expires);"
    "CREATE TABLE IF NOT EXISTS frames (job TEXT NOT NULL, number BIGINT NOT NULL,"
    " seq BIGINT NOT NULL, bytes BIGINT NOT NULL, tag TEXT NOT NULL, name TEXT NOT NULL,"
    " PRIMARY KEY (job, number));"
    "CREATE INDEX IF NOT EXISTS frames_events ON frames (job, seq);"
    "CREATE TABLE IF NOT EXISTS keys (client BIGINT NOT NULL, name TEXT NOT NULL,"
    " print TEXT NOT NULL, job TEXT NOT NULL, expires BIGINT NOT NULL,"
    " PRIMARY KEY (client, name));"
    "CREATE INDEX IF NOT EXISTS keys_jobs ON keys (job);";

#define JOB_COLUMNS                                                                                \
    "id, scene, client, kind, state, frames, done, bytes, seq, state_seq, created, ended, "        \
    "expires, settings, result_bytes, result_tag, result_name, error_code, error_pointer, "        \
    "error_message"
#define TEXT(value)                                                                                \
    {                                                                                              \
        .text = (value)                                                                            \
    }
#define NUMBER(value)                                                                              \
    {                                                                                              \
        .number = (int64_t)(value)                                                                 \
    }
#define COUNT(array) ((uint32_t)(sizeof(array) / sizeof *(array)))

struct hex {
    char text[PEN_ID_HEX + 1];
};
static struct hex hex_of(const uint8_t id[PEN_ID_BYTES])
{
    struct hex hex;
    pen_id_to_hex(id, hex.text);
    return hex;
}

static void copy(char *to, size_t bytes, const char *from)
{
    snprintf(to, bytes, "%s", from ? from : "");
}

struct job_store *job_store_open(const char *path, struct pen_error *error)
{
    struct database *database = database_open(path, error);
    if (!database)
        return NULL;
    struct database *reader =
        database_script(database, schema, error) ? database_open_reader(path, error) : NULL;
    if (!reader) {
        database_close(database);
        return NULL;
    }
    struct job_store *s = pen_alloc_zero(1, sizeof *s);
    pthread_mutex_init(&s->lock, NULL);
    pthread_mutex_init(&s->read_lock, NULL);
    s->database = database;
    s->reader = reader;
    return s;
}

void job_store_close(struct job_store *s)
{
    if (!s)
        return;
    database_close(s->reader);
    database_close(s->database);
    pthread_mutex_destroy(&s->read_lock);
    pthread_mutex_destroy(&s->lock);
    free(s);
}

/* One statement that only reads. */
static bool query(struct job_store *s, const char *sql, const struct database_value *values,
    uint32_t count, database_row *row, void *context, struct pen_error *error)
{
    pthread_mutex_lock(&s->read_lock);
    bool ok = database_run(s->reader, sql, values, count, row, context, error);
    pthread_mutex_unlock(&s->read_lock);
    return ok;
}

static void read_number(void *context, const struct database_value *columns)
{
    *(int64_t *)context = columns[0].number;
}

/* ---- rows ---- */

struct job_rows {
    struct job *jobs;
    uint32_t most, count;
};

static void read_job(void *context, const struct database_value *c)
{
    struct job_rows *into = context;
    if (into->count == into->most)
        return;
    struct job *job = &into->jobs[into->count];
    memset(job, 0, sizeof *job);
    bool ok = c[0].text && c[1].text && pen_id_from_hex(c[0].text, job->id) &&
              pen_id_from_hex(c[1].text, job->scene) && c[3].number >= 0 &&
              c[3].number < JOB_KINDS && c[4].number >= 0 && c[4].number < JOB_STATES;
    if (!ok) /* somebody else has written it */
        return;
    job->client = (uint64_t)c[2].number;
    job->kind = (enum job_kind)c[3].number;
    job->state = (enum job_state)c[4].number;
    job->frames = (uint32_t)c[5].number;
    job->done = (uint32_t)c[6].number;
    job->bytes = (uint64_t)c[7].number;
    job->seq = (uint32_t)c[8].number;
    job->state_seq = (uint32_t)c[9].number;
    job->created_s = c[10].number;
    job->ended_s = c[11].number;
    job->expires_s = c[12].number;
    copy(job->settings, sizeof job->settings, c[13].text);
    job->result.bytes = (uint64_t)c[14].number;
    copy(job->result.tag, sizeof job->result.tag, c[15].text);
    copy(job->result.name, sizeof job->result.name, c[16].text);
    job->error.code = (uint32_t)c[17].number;
    copy(job->error.pointer, sizeof job->error.pointer, c[18].text);
    copy(job->error.message, sizeof job->error.message, c[19].text);
    into->count++;
}

struct frames_read {
    struct job_frame *frames;
    uint32_t most, count;
};

static void read_frame(void *context, const struct database_value *c)
{
    struct frames_read *into = context;
    if (into->count == into->most)
        return;
    struct job_frame *frame = &into->frames[into->count++];
    memset(frame, 0, sizeof *frame);
    frame->number = (uint32_t)c[0].number;
    frame->seq = (uint32_t)c[1].number;
    frame->file.bytes = (uint64_t)c[2].number;
    copy(frame->file.tag, sizeof frame->file.tag, c[3].text);
    copy(frame->file.name, sizeof frame->file.name, c[4].text);
}

/* ---- adding ---- */

static bool count(struct job_store *s, const char *sql, const struct database_value *values,
    uint32_t values_count, int64_t *number, struct pen_error *error)
{
    *number = 0;
    return database_run(s->database, sql, values, values_count, read_number, number, error);
}

/* Until the next one expires; `client` 0: anybody's. */
static uint32_t retry_s(struct job_store *s, uint64_t client, int64_t now_s)
{
    int64_t next = 0;
    struct database_value values[] = {NUMBER(client)};
    if (client)
        count(s, "SELECT COALESCE(MIN(expires), 0) FROM jobs WHERE expires > 0 AND client = $1",
            values, 1, &next, NULL);
    else
        count(s, "SELECT COALESCE(MIN(expires), 0) FROM jobs WHERE expires > 0", NULL, 0, &next,
            NULL);
    return next > now_s ? (uint32_t)(next - now_s) : 0;
}

/* Whether there is room for one more; the lock is held. */
static bool has_room(struct job_store *s, const struct job *job, const struct job_limits *limits,
    struct pen_error *error)
{
    int64_t active, own_active, kept, own_kept, bytes;
    struct database_value values[] = {NUMBER(job->client)};
    if (!count(s, "SELECT COUNT(*) FROM jobs WHERE state < 2", NULL, 0, &active, error) ||
        !count(s, "SELECT COUNT(*) FROM jobs WHERE state < 2 AND client = $1", values, 1,
            &own_active, error) ||
        !count(s, "SELECT COUNT(*) FROM jobs", NULL, 0, &kept, error) ||
        !count(s, "SELECT COUNT(*) FROM jobs WHERE client = $1", values, 1, &own_kept, error) ||
        !count(s, "SELECT COALESCE(SUM(bytes), 0) FROM jobs", NULL, 0, &bytes, error))
        return false;
    if (own_active >= limits->active_per_client)
        return pen_fail(error, PEN_TOO_MANY, "", "This client already has %u jobs under way.",
            (unsigned)own_active);
    if (active >= limits->active)
        return pen_fail(
            error, PEN_UNAVAILABLE, "", "There are %u jobs under way already.", (unsigned)active);
    if (own_kept >= limits->kept_per_client) {
        pen_fail(error, PEN_TOO_MANY, "",
            "This client already has %u jobs: delete some, or wait until one expires.",
            (unsigned)own_kept);
        error->retry_after_s = retry_s(s, job->client, job->created_s);
        return false;
    }
    if (kept < limits->kept && (uint64_t)bytes < limits->bytes)
        return true;
    pen_fail(error, PEN_UNAVAILABLE, "", "There is no room for more results of jobs.");
    error->retry_after_s = retry_s(s, 0, job->created_s);
    return false;
}

struct key_read {
    char print[PEN_ID_HEX + 1], job[PEN_ID_HEX + 1];
    bool found;
};

static void read_key(void *context, const struct database_value *columns)
{
    struct key_read *into = context;
    copy(into->print, sizeof into->print, columns[0].text);
    copy(into->job, sizeof into->job, columns[1].text);
    into->found = true;
}

/* As job_store_find_key, with the database's lock held. */
static bool find_key(struct database *database, const struct job_key *key, int64_t now_s,
    bool *found, bool *has_job, uint8_t id[PEN_ID_BYTES], struct pen_error *error)
{
    struct hex print = hex_of(key->print);
    struct database_value values[] = {NUMBER(key->client), TEXT(key->text), NUMBER(now_s)};
    struct key_read read = {0};
    bool ok = database_run(database,
        "SELECT print, job FROM keys WHERE client = $1 AND name = $2 AND (expires > $3 OR "
        "job <> '')",
        values, COUNT(values), read_key, &read, error);
    *found = ok && read.found;
    *has_job = *found && pen_id_from_hex(read.job, id);
    if (*found && strcmp(print.text, read.print))
        return pen_fail(error, PEN_INVALID, "",
            "This Idempotency-Key came with another request before: a new request needs a new "
            "one.");
    return ok;
}

bool job_store_find_key(struct job_store *s, const struct job_key *key, int64_t now_s, bool *found,
    bool *has_job, uint8_t id[PEN_ID_BYTES], struct pen_error *error)
{
    pthread_mutex_lock(&s->read_lock);
    bool ok = find_key(s->reader, key, now_s, found, has_job, id, error);
    pthread_mutex_unlock(&s->read_lock);
    return ok;
}

static bool put_key(
    struct job_store *s, const struct job_key *key, const char *job, struct pen_error *error)
{
    struct hex print = hex_of(key->print);
    struct database_value values[] = {
        NUMBER(key->client), TEXT(key->text), TEXT(print.text), TEXT(job), NUMBER(key->expires_s)};
    struct database_value client[] = {NUMBER(key->client), NUMBER(MOST_KEYS)};
    return database_run(s->database,
               "INSERT INTO keys (client, name, print, job, expires) VALUES ($1, $2, $3, $4, $5) "
               "ON CONFLICT (client, name) DO UPDATE SET print = excluded.print, "
               "job = excluded.job, expires = excluded.expires",
               values, COUNT(values), NULL, NULL, error) &&
           database_run(s->database,
               "DELETE FROM keys WHERE client = $1 AND name IN (SELECT name FROM keys "
               "WHERE client = $1 ORDER BY expires DESC, name LIMIT 1000000 OFFSET $2)",
               client, COUNT(client), NULL, NULL, error);
}

static bool insert(struct job_store *s, const struct job *job, const char *body,
    const struct job_key *key, struct pen_error *error)
{
    struct hex id = hex_of(job->id), scene = hex_of(job->scene);
    struct database_value values[] = {TEXT(id.text), TEXT(scene.text), NUMBER(job->client),
        NUMBER(job->kind), NUMBER(job->frames), NUMBER(job->created_s), TEXT(body)};
    return database_run(s->database,
               "INSERT INTO jobs (id, scene, client, kind, state, frames, done, bytes, seq, "
               "state_seq, created, ended, expires, settings, result_bytes, result_tag, "
               "result_name, error_code, error_pointer, error_message, body) VALUES ($1, $2, "
               "$3, $4, 0, $5, 0, 0, 1, 1, $6, 0, 0, '', 0, '', '', 0, '', '', $7)",
               values, COUNT(values), NULL, NULL, error) &&
           (!key || put_key(s, key, id.text, error));
}

bool job_store_add(struct job_store *s, struct job *job, const char *body,
    const struct job_key *key, const struct job_limits *limits, struct pen_error *error)
{
    bool found = false, has_job = false;
    uint8_t before[PEN_ID_BYTES];
    pthread_mutex_lock(&s->lock);
    bool begun = database_begin(s->database, error);
    bool ok =
        begun &&
        (!key || find_key(s->database, key, job->created_s, &found, &has_job, before, error)) &&
        (has_job || (has_room(s, job, limits, error) && insert(s, job, body, key, error)));
    ok = begun && database_end(s->database, ok, error);
    pthread_mutex_unlock(&s->lock);
    if (ok && has_job)
        memcpy(job->id, before, PEN_ID_BYTES);
    return ok;
}

/* ---- reading ---- */

bool job_store_get(
    struct job_store *s, const uint8_t id[PEN_ID_BYTES], struct job *job, struct pen_error *error)
{
    struct hex hex = hex_of(id);
    struct database_value values[] = {TEXT(hex.text)};
    struct job_rows read = {job, 1, 0};
    return query(s, "SELECT " JOB_COLUMNS " FROM jobs WHERE id = $1", values, 1, read_job, &read,
               error) &&
           (read.count ||
               pen_fail(error, PEN_NOT_FOUND, "", "There is no such job, or it has expired."));
}

static void read_text(void *context, const struct database_value *columns)
{
    *(char **)context = columns[0].text ? strdup(columns[0].text) : NULL;
}

char *job_store_body(struct job_store *s, const uint8_t id[PEN_ID_BYTES])
{
    struct hex hex = hex_of(id);
    struct database_value values[] = {TEXT(hex.text)};
    char *body = NULL;
    query(s, "SELECT body FROM jobs WHERE id = $1", values, 1, read_text, &body, NULL);
    return body;
}

bool job_store_list(struct job_store *s, struct job_page *page, struct pen_error *error)
{
    struct hex before = {"g"}; /* behind every id */
    if (page->before)
        before = hex_of(page->before);
    struct database_value values[] = {
        NUMBER(page->client), NUMBER(page->state), TEXT(before.text), NUMBER(page->most)};
    struct job_rows read = {page->jobs, page->most, 0};
    int64_t total = 0;
    bool ok = query(s,
                  "SELECT " JOB_COLUMNS " FROM jobs WHERE ($1 = 0 OR client = $1) AND ($2 = 5 OR "
                  "state = $2) AND id < $3 ORDER BY id DESC LIMIT $4",
                  values, 4, read_job, &read, error) &&
              query(s,
                  "SELECT COUNT(*) FROM jobs WHERE ($1 = 0 OR client = $1) AND ($2 = 5 OR "
                  "state = $2)",
                  values, 2, read_number, &total, error);
    page->count = read.count;
    page->total = (uint32_t)total;
    return ok;
}

struct ids_read {
    uint8_t (*ids)[PEN_ID_BYTES];
    uint32_t count;
    size_t capacity;
};

static void read_id(void *context, const struct database_value *columns)
{
    struct ids_read *into = context;
    into->ids = pen_grow(into->ids, &into->capacity, into->count + 1, sizeof *into->ids);
    if (columns[0].text && pen_id_from_hex(columns[0].text, into->ids[into->count]))
        into->count++;
}

bool job_store_active(
    struct job_store *s, uint8_t (**ids)[PEN_ID_BYTES], uint32_t *count, struct pen_error *error)
{
    struct ids_read read = {0};
    bool ok =
        query(s, "SELECT id FROM jobs WHERE state < 2 ORDER BY id", NULL, 0, read_id, &read, error);
    *ids = read.ids;
    *count = read.count;
    return ok;
}

bool job_store_exists(
    struct job_store *s, const uint8_t id[PEN_ID_BYTES], bool *exists, struct pen_error *error)
{
    struct hex hex = hex_of(id);
    struct database_value values[] = {TEXT(hex.text)};
    int64_t number = 0;
    bool ok =
        query(s, "SELECT COUNT(*) FROM jobs WHERE id = $1", values, 1, read_number, &number, error);
    *exists = number > 0;
    return ok;
}

bool job_store_frames(struct job_store *s, const uint8_t id[PEN_ID_BYTES], uint32_t seq,
    struct job_frame *frames, uint32_t most, uint32_t *count, uint32_t *before,
    struct pen_error *error)
{
    struct hex hex = hex_of(id);
    struct database_value values[] = {TEXT(hex.text), NUMBER(seq), NUMBER(most)};
    struct frames_read read = {frames, most, 0};
    int64_t number = 0;
    bool ok = query(s,
                  "SELECT number, seq, bytes, tag, name FROM frames WHERE job = $1 AND seq > $2 "
                  "ORDER BY seq LIMIT $3",
                  values, 3, read_frame, &read, error) &&
              (!before || query(s, "SELECT COUNT(*) FROM frames WHERE job = $1 AND seq <= $2",
                              values, 2, read_number, &number, error));
    *count = read.count;
    if (before)
        *before = (uint32_t)number;
    return ok;
}

bool job_store_frame(struct job_store *s, const uint8_t id[PEN_ID_BYTES], uint32_t number,
    struct job_frame *frame, struct pen_error *error)
{
    struct hex hex = hex_of(id);
    struct database_value values[] = {TEXT(hex.text), NUMBER(number)};
    struct frames_read read = {frame, 1, 0};
    return query(s,
               "SELECT number, seq, bytes, tag, name FROM frames WHERE job = $1 AND number = $2",
               values, 2, read_frame, &read, error) &&
           (read.count || pen_fail(error, PEN_NOT_FOUND, "", "This frame is not there."));
}

/* ---- progress ---- */

bool job_store_add_frame(struct job_store *s, const uint8_t id[PEN_ID_BYTES],
    const struct job_frame *frame, struct pen_error *error)
{
    struct hex hex = hex_of(id);
    struct database_value values[] = {TEXT(hex.text), NUMBER(frame->number),
        NUMBER(frame->file.bytes), TEXT(frame->file.tag), TEXT(frame->file.name)};
    struct database_value job[] = {TEXT(hex.text)};
    int64_t there = 0;
    pthread_mutex_lock(&s->lock);
    bool begun = database_begin(s->database, error);
    bool ok = begun && count(s, "SELECT COUNT(*) FROM frames WHERE job = $1 AND number = $2",
                           values, 2, &there, error);
    if (ok && !there)
        ok = database_run(s->database,
                 "INSERT INTO frames (job, number, seq, bytes, tag, name) SELECT $1, CAST($2 AS "
                 "BIGINT), seq + 1, CAST($3 AS BIGINT), $4, $5 FROM jobs WHERE id = $1",
                 values, COUNT(values), NULL, NULL, error) &&
             database_run(s->database,
                 "UPDATE jobs SET seq = seq + 1, done = (SELECT COUNT(*) FROM frames WHERE "
                 "job = $1), bytes = (SELECT SUM(bytes) FROM frames WHERE job = $1) WHERE id = $1",
                 job, 1, NULL, NULL, error);
    ok = begun && database_end(s->database, ok, error);
    pthread_mutex_unlock(&s->lock);
    return ok;
}

bool job_store_set_settings(struct job_store *s, const uint8_t id[PEN_ID_BYTES],
    const char *settings, struct pen_error *error)
{
    struct hex hex = hex_of(id);
    struct database_value values[] = {TEXT(hex.text), TEXT(settings)};
    pthread_mutex_lock(&s->lock);
    bool ok = database_run(
        s->database, "UPDATE jobs SET settings = $2 WHERE id = $1", values, 2, NULL, NULL, error);
    pthread_mutex_unlock(&s->lock);
    return ok;
}

bool job_store_set_state(struct job_store *s, const struct job *job, struct pen_error *error)
{
    struct hex id = hex_of(job->id);
    struct database_value values[] = {TEXT(id.text), NUMBER(job->state), NUMBER(job->ended_s),
        NUMBER(job->expires_s), NUMBER(job->result.bytes), TEXT(job->result.tag),
        TEXT(job->result.name), NUMBER(job->error.code), TEXT(job->error.pointer),
        TEXT(job->error.message)};
    int64_t active = 0;
    pthread_mutex_lock(&s->lock);
    bool begun = database_begin(s->database, error);
    bool ok = begun && count(s, "SELECT COUNT(*) FROM jobs WHERE id = $1 AND state < 2", values, 1,
                           &active, error);
    if (ok && active)
        ok = database_run(s->database,
            "UPDATE jobs SET state = $2, ended = $3, expires = $4, result_bytes = $5, "
            "result_tag = $6, result_name = $7, error_code = $8, error_pointer = $9, "
            "error_message = $10, seq = seq + 1, state_seq = seq + 1, bytes = bytes + $5 "
            "WHERE id = $1",
            values, COUNT(values), NULL, NULL, error);
    ok = begun && database_end(s->database, ok, error);
    pthread_mutex_unlock(&s->lock);
    return ok && active;
}

/* ---- forgetting ---- */

/* With the lock held. */
static bool forget(struct job_store *s, const char *id, struct pen_error *error)
{
    struct database_value values[] = {TEXT(id)};
    bool begun = database_begin(s->database, error);
    bool ok = begun;
    static const char *const statements[] = {"DELETE FROM frames WHERE job = $1",
        "DELETE FROM keys WHERE job = $1", "DELETE FROM jobs WHERE id = $1"};
    for (uint32_t i = 0; ok && i < COUNT(statements); i++)
        ok = database_run(s->database, statements[i], values, 1, NULL, NULL, error);
    return begun && database_end(s->database, ok, error);
}

bool job_store_remove(struct job_store *s, const uint8_t id[PEN_ID_BYTES], struct pen_error *error)
{
    struct hex hex = hex_of(id);
    pthread_mutex_lock(&s->lock);
    bool ok = forget(s, hex.text, error);
    pthread_mutex_unlock(&s->lock);
    return ok;
}

bool job_store_expire(struct job_store *s, int64_t now_s, uint8_t id[PEN_ID_BYTES])
{
    struct database_value values[] = {NUMBER(now_s)};
    char *hex = NULL;
    pthread_mutex_lock(&s->lock);
    bool ok =
        database_run(s->database, "DELETE FROM keys WHERE expires <= $1 AND job = ''", values, 1,
            NULL, NULL, NULL) &&
        database_run(s->database,
            "SELECT id FROM jobs WHERE expires > 0 AND expires <= $1 ORDER BY expires LIMIT 1",
            values, 1, read_text, &hex, NULL) &&
        hex && pen_id_from_hex(hex, id) && forget(s, hex, NULL);
    pthread_mutex_unlock(&s->lock);
    free(hex);
    return ok;
}

/* ---- keys ---- */

bool job_store_keep_key(struct job_store *s, const struct job_key *key, struct pen_error *error)
{
    pthread_mutex_lock(&s->lock);
    bool begun = database_begin(s->database, error);
    bool ok = begun && put_key(s, key, "", error);
    ok = begun && database_end(s->database, ok, error);
    pthread_mutex_unlock(&s->lock);
    return ok;
}

/* ---- numbers ---- */

static void read_state(void *context, const struct database_value *columns)
{
    struct job_numbers *numbers = context;
    if (columns[0].number >= 0 && columns[0].number < JOB_STATES)
        numbers->jobs[columns[0].number] = (uint32_t)columns[1].number;
    numbers->bytes += (uint64_t)columns[2].number;
}

bool job_store_read(struct job_store *s, struct job_numbers *numbers, struct pen_error *error)
{
    memset(numbers, 0, sizeof *numbers);
    return query(s, "SELECT state, COUNT(*), SUM(bytes) FROM jobs GROUP BY state", NULL, 0,
        read_state, numbers, error);
}
