/* Reading small files whole: regular ones, and what comes in pieces. */
#include "server/base/file.h"
#include "tests/unit/check.h"
#include <stdbool.h>
#include <sys/mman.h>
#include <unistd.h>

static void check_size(size_t size, size_t most, bool fits)
{
    int fd = memfd_create("file", MFD_CLOEXEC);
    size_t bytes = 0;
    for (size_t i = 0; i < size; i++)
        CHECK(write(fd, i % 7 ? "a" : "b", 1) == 1);
    lseek(fd, 0, SEEK_SET);
    char *text = file_read(fd, most, &bytes);
    CHECK((text != NULL) == fits);
    if (text) {
        CHECK(bytes == size && strlen(text) == size && text[0] == 'b' && text[1] == 'a');
        CHECK(text[7 * ((size - 1) / 7)] == 'b');
    }
    free(text);
    close(fd);
}

int main(void)
{
    check_size(0, 100, false);
    check_size(100, 100, true);
    check_size(101, 100, false);
    check_size(10000, 20000, true);
    check_size(20001, 20000, false);

    int ends[2];
    size_t bytes;
    CHECK(!pipe(ends) && write(ends[1], "two ", 4) == 4 && write(ends[1], "pieces", 6) == 6);
    close(ends[1]);
    char *text = file_read(ends[0], 10, &bytes);
    CHECK(text && bytes == 10);
    CHECK_STR(text ? text : "", "two pieces");
    free(text);
    close(ends[0]);
    CHECK(!file_read(ends[0], 10, &bytes)); /* closed */
    CHECK_DONE();
}
