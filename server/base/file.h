/* Small files. */
#pragma once
#include <stdbool.h>
#include <stddef.h>

/* All that `fd` (which stays the caller's) still holds, 1 to `most` bytes, with a NUL behind; the
 * caller frees it. NULL: it holds nothing, or more, or cannot be read. */
char *file_read(int fd, size_t most, size_t *bytes);
/* Gives `from` the name `to`, in place of whatever has it, even a folder with all that is in it. */
bool file_replace(int from_folder, const char *from, int to_folder, const char *to);
/* A file, or a folder with all that is in it, some levels deep. */
void file_remove_all(int parent, const char *name);
