/* How many uploads are under way, and whose. */
#pragma once
#include "protocol/error.h"

struct places;
struct places *places_create(uint32_t most);
void places_destroy(struct places *places); /* NULL is fine */
/* One more of this client's, who cannot have the last quarter of them. Errors: PEN_TOO_MANY,
 * PEN_UNAVAILABLE. */
bool places_take(struct places *places, uint64_t client, struct pen_error *error);
void places_leave(struct places *places, uint64_t client);
