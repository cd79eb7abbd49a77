/* What else people upload, told by its first bytes or its name. */
#pragma once
#include <stddef.h>
#include <stdint.h>

/* A sentence that says what the bytes are and what to do with them; NULL: not known. */
const char *imp_foreign_bytes(const uint8_t *data, size_t bytes);
const char *imp_foreign_name(const char *name);
