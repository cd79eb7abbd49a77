#include "server/access/auth.h"
#include "protocol/fnv.h"
#include "protocol/limits.h"
#include "protocol/memory.h"
#include "server/base/hash.h"
#include <ctype.h>
#include <errno.h>
#include <fcntl.h>
#include <openssl/crypto.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>

#define MIN_TOKEN 16
#define SECOND_NS 1000000000ull

static const char *const scope_names[] = {"read", "render", "upload", "admin"};
#define SCOPES (sizeof scope_names / sizeof *scope_names)

struct row {
    uint8_t digest[PEN_ID_BYTES]; /* tokens are kept and compared as hashes */
    struct auth_grant grant;
};

/* What an owner is about, which outlives a reload. */
struct usage {
    uint64_t owner, renders;
    double requests; /* that may come at once */
    uint64_t filled_ns;
    struct usage *next;
};

struct rows {
    struct row *list;
    uint32_t count;
};

struct auth {
    pthread_mutex_t lock; /* guards what follows */
    struct rows rows;
    struct usage *usages;
};

const char *auth_scope_name(enum auth_scope scope)
{
    return scope_names[__builtin_ctz(scope)];
}

static void digest_of(const char *token, uint8_t digest[PEN_ID_BYTES])
{
    struct hash *hash = hash_create();
    hash_add(hash, token, strlen(token));
    hash_finish(hash, digest);
}

/* ---- the file ---- */

static bool read_scopes(const char *word, uint32_t *scopes)
{
    uint32_t all = 0;
    for (size_t n; *word; word += n + (word[n] == ',')) {
        uint32_t found = 0;
        n = strcspn(word, ",");
        for (size_t s = 0; s < SCOPES; s++)
            if (strlen(scope_names[s]) == n && !strncmp(word, scope_names[s], n))
                found = 1u << s;
        if (!found)
            return false;
        all |= found;
    }
    if (all)
        *scopes = all;
    return all != 0;
}

static bool read_limit(const char *word, struct auth_grant *grant)
{
    const struct {
        const char *name;
        uint64_t *value;
    } limits[] = {{"requests_per_s=", &grant->requests_per_s}, {"renders=", &grant->renders},
        {"stored_bytes=", &grant->stored_bytes}};
    for (size_t l = 0; l < sizeof limits / sizeof *limits; l++) {
        size_t n = strlen(limits[l].name);
        char *end;
        if (strncmp(word, limits[l].name, n) || !isdigit((unsigned char)word[n]))
            continue;
        errno = 0;
        *limits[l].value = strtoull(word + n, &end, 10);
        int shift = *end == 'K' ? 10 : *end == 'M' ? 20 : *end == 'G' ? 30 : 0;
        bool fits = !errno && *limits[l].value <= UINT64_MAX >> shift;
        *limits[l].value <<= shift;
        return fits && !*(end + (shift != 0)) && *limits[l].value;
    }
    return false;
}

static bool read_line(char *line, struct rows *rows, uint32_t number, struct pen_error *error)
{
    char *rest = NULL, *first = strtok_r(line, " \t\r\n", &rest);
    char *second = first ? strtok_r(NULL, " \t\r\n", &rest) : NULL;
    if (!first || *first == '#')
        return true;
    const char *token = second ? second : first;
    struct row row = {.grant = {.scopes = AUTH_READ | AUTH_RENDER | AUTH_UPLOAD}};
    if (strlen(token) < MIN_TOKEN)
        return pen_fail(error, PEN_INVALID, "",
            "Line %u of the token file: a token has fewer than %d characters.", number, MIN_TOKEN);
    if (second && strlen(first) >= AUTH_NAME_BYTES)
        return pen_fail(
            error, PEN_INVALID, "", "Line %u of the token file: the name is too long.", number);
    if (second)
        strcpy(row.grant.name, first);
    for (char *word; (word = strtok_r(NULL, " \t\r\n", &rest));)
        if (!read_scopes(word, &row.grant.scopes) && !read_limit(word, &row.grant))
            return pen_fail(error, PEN_INVALID, "",
                "Line %u of the token file: \"%.40s\" is neither scopes (read, render, upload, "
                "admin, "
                "with commas) nor requests_per_s=N, renders=N or stored_bytes=N.",
                number, word);
    const char *whose = second ? first : token;
    row.grant.owner = pen_fnv(PEN_FNV_START, whose, strlen(whose)) | 1ull << 62;
    digest_of(token, row.digest);
    rows->list = pen_realloc_array(rows->list, rows->count + 1, sizeof *rows->list);
    rows->list[rows->count++] = row;
    return true;
}

static bool read_file(const char *path, struct rows *rows, struct pen_error *error)
{
    char line[1024];
    struct stat status;
    FILE *file = fopen(path, "re");
    bool ok = file != NULL;
    if (!ok)
        pen_fail(error, PEN_UNAVAILABLE, "", "The token file cannot be read: %s.", strerror(errno));
    else if (!fstat(fileno(file), &status) && S_ISREG(status.st_mode) && status.st_mode & S_IRWXO)
        ok = pen_fail(error, PEN_INVALID, "",
            "Everybody on this machine can read the token file: chmod o-rwx %.300s", path);
    for (uint32_t number = 1; ok && fgets(line, sizeof line, file); number++)
        ok = read_line(line, rows, number, error);
    if (ok && !rows->count)
        ok = pen_fail(error, PEN_INVALID, "", "The token file holds no token.");
    if (file)
        fclose(file);
    if (!ok)
        free(rows->list);
    return ok;
}

struct auth *auth_load(const char *path, struct pen_error *error)
{
    struct rows rows = {0};
    if (!read_file(path, &rows, error))
        return NULL;
    struct auth *auth = pen_alloc_zero(1, sizeof *auth);
    auth->rows = rows;
    pthread_mutex_init(&auth->lock, NULL);
    return auth;
}

bool auth_reload(struct auth *auth, const char *path, struct pen_error *error)
{
    struct rows rows = {0};
    if (!read_file(path, &rows, error))
        return false;
    pthread_mutex_lock(&auth->lock);
    struct row *old = auth->rows.list;
    auth->rows = rows;
    pthread_mutex_unlock(&auth->lock);
    free(old);
    return true;
}

void auth_destroy(struct auth *auth)
{
    if (!auth)
        return;
    for (struct usage *usage = auth->usages, *next; usage; usage = next) {
        next = usage->next;
        free(usage);
    }
    free(auth->rows.list);
    pthread_mutex_destroy(&auth->lock);
    free(auth);
}

bool auth_check(struct auth *auth, const char *authorization, struct auth_grant *grant)
{
    memset(grant, 0, sizeof *grant);
    if (!authorization || strncasecmp(authorization, "Bearer ", 7))
        return false;
    uint8_t digest[PEN_ID_BYTES];
    digest_of(authorization + 7 + strspn(authorization + 7, " "), digest);
    pthread_mutex_lock(&auth->lock);
    for (uint32_t i = 0; i < auth->rows.count; i++) /* all of them, whatever is found */
        if (!CRYPTO_memcmp(digest, auth->rows.list[i].digest, PEN_ID_BYTES))
            *grant = auth->rows.list[i].grant;
    pthread_mutex_unlock(&auth->lock);
    return grant->owner != 0;
}

/* ---- limits ---- */

/* Under the lock. */
static struct usage *usage_of(struct auth *auth, const struct auth_grant *grant)
{
    struct usage *usage = auth->usages;
    while (usage && usage->owner != grant->owner)
        usage = usage->next;
    if (!usage) {
        usage = pen_alloc_zero(1, sizeof *usage);
        usage->owner = grant->owner;
        usage->requests = (double)grant->requests_per_s;
        usage->next = auth->usages;
        auth->usages = usage;
    }
    return usage;
}

bool auth_count(
    struct auth *auth, const struct auth_grant *grant, uint64_t now_ns, struct pen_error *error)
{
    double rate = (double)grant->requests_per_s;
    if (!grant->requests_per_s)
        return true;
    pthread_mutex_lock(&auth->lock);
    struct usage *usage = usage_of(auth, grant);
    if (now_ns > usage->filled_ns) {
        double more = (double)(now_ns - usage->filled_ns) / (double)SECOND_NS * rate;
        usage->requests = usage->requests + more < rate ? usage->requests + more : rate;
        usage->filled_ns = now_ns;
    }
    bool fits = usage->requests >= 1;
    usage->requests -= fits;
    pthread_mutex_unlock(&auth->lock);
    if (fits)
        return true;
    pen_fail(error, PEN_TOO_MANY, "", "This token has %llu requests a second.",
        (unsigned long long)grant->requests_per_s);
    if (error)
        error->retry_after_s = 1;
    return false;
}

bool auth_enter(struct auth *auth, const struct auth_grant *grant, struct pen_error *error)
{
    pthread_mutex_lock(&auth->lock);
    struct usage *usage = usage_of(auth, grant);
    bool fits = !grant->renders || usage->renders < grant->renders;
    usage->renders += fits;
    pthread_mutex_unlock(&auth->lock);
    return fits || pen_fail(error, PEN_TOO_MANY, "", "This token may have %llu renders under way.",
                       (unsigned long long)grant->renders);
}

void auth_leave(struct auth *auth, const struct auth_grant *grant)
{
    pthread_mutex_lock(&auth->lock);
    usage_of(auth, grant)->renders--;
    pthread_mutex_unlock(&auth->lock);
}
