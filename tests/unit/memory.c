/* Allocation that cannot fail, and the hash, whose values stand in the FNV authors' test suite. */
#include "protocol/fnv.h"
#include "protocol/memory.h"
#include "tests/unit/check.h"
#include <signal.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <sys/wait.h>
#include <unistd.h>

static bool is_aborted_by(void *(*ask)(void))
{
    pid_t child = fork();
    if (!child) {
        signal(SIGABRT, SIG_DFL);
        ask();
        _exit(0);
    }
    int status;
    if (waitpid(child, &status, 0) != child)
        return false;
#ifdef __SANITIZE_ADDRESS__ /* it ends the process itself, with a report */
    if (WIFEXITED(status) && WEXITSTATUS(status))
        return true;
#endif
    return WIFSIGNALED(status) && WTERMSIG(status) == SIGABRT;
}

/* Products that overflow to something small. */
static void *overflow(void)
{
    return pen_alloc(SIZE_MAX / 2 + 2, 2);
}

static void *overflow_zero(void)
{
    return pen_alloc_zero(SIZE_MAX / 4 + 2, 4);
}

static void *overflow_again(void)
{
    return pen_realloc_array(malloc(8), SIZE_MAX / 8 + 2, 8);
}

static void *overflow_grown(void)
{
    size_t capacity = 4;
    return pen_grow(malloc(16), &capacity, SIZE_MAX / 4 + 2, 4);
}

static void check_growth(void)
{
    uint32_t *items = NULL;
    size_t capacity = 0, moves = 0;
    for (uint32_t i = 0; i < 1000; i++) {
        size_t before = capacity;
        items = pen_grow(items, &capacity, i + 1, sizeof *items);
        CHECK(capacity > i && (capacity == before || capacity >= 2 * before));
        moves += capacity != before;
        items[i] = i;
    }
    CHECK(moves <= 11); /* 1, 2, 4 ... 1024 */
    for (uint32_t i = 0; i < 1000; i++)
        CHECK(items[i] == i);
    items = pen_grow(items, &capacity, 5000, sizeof *items);
    CHECK(capacity == 5000 && items[999] == 999);
    free(items);
}

int main(void)
{
    void *none[] = {pen_alloc(0, 8), pen_alloc(8, 0), pen_alloc_zero(0, 8), pen_alloc_zero(8, 0),
        pen_realloc_array(malloc(4), 0, 8)};
    for (uint32_t i = 0; i < sizeof none / sizeof *none; i++) {
        CHECK(none[i]);
        free(none[i]);
    }
    uint8_t *zeros = pen_alloc_zero(100, 10);
    for (uint32_t i = 0; i < 1000; i++)
        CHECK(!zeros[i]);
    free(zeros);
    check_growth();
    CHECK(is_aborted_by(overflow));
    CHECK(is_aborted_by(overflow_zero));
    CHECK(is_aborted_by(overflow_again));
    CHECK(is_aborted_by(overflow_grown));

    CHECK(pen_fnv(PEN_FNV_START, "", 0) == 0xcbf29ce484222325u);
    CHECK(pen_fnv(PEN_FNV_START, "a", 1) == 0xaf63dc4c8601ec8cu);
    CHECK(pen_fnv(PEN_FNV_START, "foobar", 6) == 0x85944171f73967e8u);
    CHECK(pen_fnv(pen_fnv(PEN_FNV_START, "foo", 3), "bar", 3) == 0x85944171f73967e8u);
    CHECK_DONE();
}
