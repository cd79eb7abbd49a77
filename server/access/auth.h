/* Bearer tokens from a file: lines of "name token" or "token"; '#' begins a comment line. */
#pragma once
#include "protocol/error.h"
#include <stdint.h>

struct auth;
/* Errors: PEN_UNAVAILABLE (unreadable), PEN_INVALID (no token, a token under 16 characters). */
struct auth *auth_load(const char *path, struct pen_error *error);
void auth_destroy(struct auth *auth); /* NULL is fine */
/* The number, from 1, of the token that an Authorization header carries; 0: none of them. The time
 * it takes does not depend on how much of a token was right. NULL headers are fine. */
uint32_t auth_check(const struct auth *auth, const char *authorization);
