/* Bearer tokens from a file that only its owner reads, one a line:
 *
 *   name token [read,render,upload,admin] [requests_per_s=N] [renders=N] [stored_bytes=N]
 *
 * or "token" alone; '#' begins a comment line. Without scopes a token may read, render and upload.
 * Thread-safe. */
#pragma once
#include "protocol/error.h"
#include <stdint.h>

enum auth_scope {
    AUTH_READ = 1,   /* descriptions, lists, results */
    AUTH_RENDER = 2, /* pictures, comparisons, jobs */
    AUTH_UPLOAD = 4, /* scenes and images, and removing one's own */
    AUTH_ADMIN = 8,  /* what belongs to others; metrics beyond loopback */
};

#define AUTH_NAME_BYTES 64
/* What the token of a request allows. */
struct auth_grant {
    uint64_t
        owner; /* 0: no token. Stays with the name when the token is another, or with the token */
    uint32_t scopes;
    uint64_t requests_per_s, renders, stored_bytes; /* 0: no limit of its own */
    char name[AUTH_NAME_BYTES];                     /* "" without one */
};

struct auth;
/* Errors: PEN_UNAVAILABLE (unreadable), PEN_INVALID (others can read the file, or a line of it is
 * wrong: the message names it). */
struct auth *auth_load(const char *path, struct pen_error *error);
/* Reads the file again; on an error all stays as it was. */
bool auth_reload(struct auth *auth, const char *path, struct pen_error *error);
void auth_destroy(struct auth *auth); /* NULL is fine */
/* The grant of the token that an Authorization header carries; false: none of them. The time it takes
 * does not depend on how much of a token was right. NULL headers are fine. */
bool auth_check(struct auth *auth, const char *authorization, struct auth_grant *grant);
/* Counts a request, of a second of which `now_ns` is part. Errors: PEN_TOO_MANY. */
bool auth_count(
    struct auth *auth, const struct auth_grant *grant, uint64_t now_ns, struct pen_error *error);
/* A render begins, to be followed by auth_leave. Errors: PEN_TOO_MANY. */
bool auth_enter(struct auth *auth, const struct auth_grant *grant, struct pen_error *error);
void auth_leave(struct auth *auth, const struct auth_grant *grant);
/* "render", for messages. */
const char *auth_scope_name(enum auth_scope scope);
