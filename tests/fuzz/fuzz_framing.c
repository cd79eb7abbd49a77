/* Any bytes as what a client sends, in one piece and (by the first byte) in two: both must be judged
 * alike, end at the same place and be passed on alike; and what is passed on is passed on as it is. */
#include "server/wire/framing.h"
#include <stdlib.h>
#include <string.h>

#define REQUIRE(condition)                                                                         \
    do {                                                                                           \
        if (!(condition))                                                                          \
            abort();                                                                               \
    } while (0)

/* What is passed on. */
struct passed {
    char *text;
    size_t bytes;
};

static void pass_on(struct passed *passed, const char *text, size_t bytes)
{
    memcpy(passed->text + passed->bytes, text, bytes);
    passed->bytes += bytes;
}

/* Where the request ends, 0: not yet, or the error's code as a negative number. `passed` has room for
 * `bytes`. */
static int64_t read_request(const char *text, size_t bytes, size_t cut, struct passed *passed)
{
    struct framing framing;
    struct pen_error error = {0};
    size_t at = 0;
    framing_init(&framing);
    for (size_t have = cut;; have = bytes) {
        if (framing.state == FRAMING_HEAD) {
            int64_t n = framing_head(&framing, text, have, &error);
            REQUIRE(n <= (int64_t)have && (n >= 0 || error.code != PEN_OK));
            at = n > 0 ? (size_t)n : 0;
            pass_on(passed, text + framing.blank, n > 0 ? at - framing.blank : 0);
        }
        if (framing.state != FRAMING_HEAD && error.code == PEN_OK) {
            size_t kept = 0;
            char *copy = malloc(have - at + 1);
            REQUIRE(copy);
            memcpy(copy, text + at, have - at);
            int64_t n = framing_body(&framing, copy, have - at, &kept, &error);
            REQUIRE(n <= (int64_t)(have - at) && (n >= 0 || error.code != PEN_OK));
            REQUIRE(n < 0 || kept <= (size_t)n);
            pass_on(passed, copy, n > 0 ? kept : 0);
            free(copy);
            at += n > 0 ? (size_t)n : 0;
        }
        REQUIRE(error.code == PEN_OK || error.message[0]);
        if (error.code)
            return -(int64_t)error.code;
        if (have == bytes)
            return framing.state == FRAMING_OVER ? (int64_t)at : 0;
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (!size)
        return 0;
    const char *text = (const char *)data + 1;
    size_t bytes = size - 1;
    struct passed passed[3] = {0};
    for (int i = 0; i < 3; i++)
        passed[i].text = malloc(bytes + 1);
    int64_t end = read_request(text, bytes, bytes, &passed[0]);
    REQUIRE(end == read_request(text, bytes, data[0] % (bytes + 1), &passed[1]));
    REQUIRE(end < 0 || (passed[0].bytes == passed[1].bytes &&
                           !memcmp(passed[0].text, passed[1].text, passed[0].bytes)));
    if (end > 0) {
        struct passed *all = &passed[0], *again = &passed[2];
        REQUIRE(read_request(all->text, all->bytes, all->bytes, again) == (int64_t)all->bytes);
        REQUIRE(again->bytes == all->bytes && !memcmp(again->text, all->text, all->bytes));
    }
    for (int i = 0; i < 3; i++)
        free(passed[i].text);
    return 0;
}
