/* The Accept header (RFC 9110, section 12.5.1). */
#pragma once
#include <stdbool.h>

/* True when `type` ("image/png") may be sent; a missing header allows everything. */
bool accept_allows(const char *accept, const char *type);
/* True when the record is wanted rather than an image: application/json stands in the header with a
 * higher quality than every image. */
bool accept_record(const char *accept);
