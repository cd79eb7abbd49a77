#include "server/access/auth.h"
#include "protocol/memory.h"
#include "server/base/hash.h"
#include <errno.h>
#include <openssl/crypto.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#define MIN_TOKEN 16

struct auth {
    uint32_t count;
    uint8_t (*digests)[PEN_ID_BYTES]; /* tokens are kept and compared as hashes */
};

static void digest_of(const char *token, uint8_t digest[PEN_ID_BYTES])
{
    struct hash *hash = hash_create();
    hash_add(hash, token, strlen(token));
    hash_finish(hash, digest);
}

struct auth *auth_load(const char *path, struct pen_error *error)
{
    struct auth *auth = pen_alloc_zero(1, sizeof *auth);
    char line[1024];
    FILE *file = fopen(path, "re");
    if (!file) {
        pen_fail(error, PEN_UNAVAILABLE, "", "The token file cannot be read: %s.", strerror(errno));
        goto fail;
    }
    while (fgets(line, sizeof line, file)) {
        char *rest = NULL, *first = strtok_r(line, " \t\r\n", &rest);
        char *second = first ? strtok_r(NULL, " \t\r\n", &rest) : NULL;
        if (!first || *first == '#')
            continue;
        const char *token = second ? second : first;
        if (strlen(token) < MIN_TOKEN) {
            pen_fail(error, PEN_INVALID, "", "A token has fewer than %d characters.", MIN_TOKEN);
            goto fail;
        }
        auth->digests = pen_realloc_array(auth->digests, auth->count + 1, sizeof *auth->digests);
        digest_of(token, auth->digests[auth->count++]);
    }
    if (!auth->count) {
        pen_fail(error, PEN_INVALID, "", "The token file holds no token.");
        goto fail;
    }
    fclose(file);
    return auth;
fail:
    if (file)
        fclose(file);
    auth_destroy(auth);
    return NULL;
}

void auth_destroy(struct auth *auth)
{
    if (!auth)
        return;
    free(auth->digests);
    free(auth);
}

uint32_t auth_check(const struct auth *auth, const char *authorization)
{
    if (!authorization || strncasecmp(authorization, "Bearer ", 7))
        return 0;
    uint8_t digest[PEN_ID_BYTES];
    uint32_t found = 0;
    digest_of(authorization + 7 + strspn(authorization + 7, " "), digest);
    for (uint32_t i = 0; i < auth->count; i++) /* all of them, whatever is found */
        if (!CRYPTO_memcmp(digest, auth->digests[i], PEN_ID_BYTES))
            found = i + 1;
    return found;
}
