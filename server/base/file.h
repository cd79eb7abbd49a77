/* Small files. */
#pragma once
#include <stddef.h>

/* All that `fd` (which stays the caller's) still holds, 1 to `most` bytes, with a NUL behind; the
 * caller frees it. NULL: it holds nothing, or more, or cannot be read. */
char *file_read(int fd, size_t most, size_t *bytes);
