#include "server/base/file.h"
#include "protocol/memory.h"
#include <stdlib.h>
#include <sys/types.h>
#include <unistd.h>

#define PIECE 4096

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
