#include "server/base/file.h"
#include "protocol/memory.h"
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/types.h>
#include <unistd.h>

#define PIECE 4096
#define MAX_DEPTH 8

char *file_read(int fd, size_t most, size_t *bytes)
{
    char *text = NULL;
    size_t capacity = 0, count = 0;
    ssize_t n;
    do {
        text = pen_grow(text, &capacity, count + PIECE + 1, 1);
        n = read(fd, text + count, capacity - count - 1);
        count += n > 0 ? (size_t)n : 0;
    } while (n > 0 && count <= most);
    if (n < 0 || !count || count > most) {
        free(text);
        return NULL;
    }
    text[count] = 0;
    *bytes = count;
    return text;
}

static void remove_levels(int parent, const char *name, uint32_t levels)
{
    int folder = openat(parent, name, O_RDONLY | O_DIRECTORY | O_CLOEXEC | O_NOFOLLOW);
    DIR *dir = folder >= 0 ? fdopendir(folder) : NULL;
    struct dirent *item;
    while (dir && (item = readdir(dir)))
        if (strcmp(item->d_name, ".") && strcmp(item->d_name, "..") &&
            unlinkat(folder, item->d_name, 0) && levels)
            remove_levels(folder, item->d_name, levels - 1);
    if (dir)
        closedir(dir);
    else if (folder >= 0)
        close(folder);
    if (unlinkat(parent, name, AT_REMOVEDIR) && errno == ENOTDIR)
        unlinkat(parent, name, 0);
}

void file_remove_all(int parent, const char *name)
{
    remove_levels(parent, name, MAX_DEPTH);
}

bool file_replace(int from_folder, const char *from, int to_folder, const char *to)
{
    if (!renameat(from_folder, from, to_folder, to))
        return true;
    if (errno != EISDIR)
        return false;
    file_remove_all(to_folder, to);
    return !renameat(from_folder, from, to_folder, to);
}
