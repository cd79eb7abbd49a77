/* Any bytes as what a client sends, in one piece and (by the first byte) in two: both must be judged
 * alike, and end at the same place. */
#include "server/wire/framing.h"
#include <stdlib.h>
#include <string.h>

#define REQUIRE(condition)                                                                         \
    do {                                                                                           \
        if (!(condition))                                                                          \
            abort();                                                                               \
    } while (0)

/* Where the request ends, 0: not yet, or the error's code as a negative number. */
static int64_t read_request(const char *text, size_t bytes, size_t cut)
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
        }
        if (framing.state != FRAMING_HEAD && error.code == PEN_OK) {
            int64_t n = framing_body(&framing, text + at, have - at, &error);
            REQUIRE(n <= (int64_t)(have - at) && (n >= 0 || error.code != PEN_OK));
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
    REQUIRE(read_request(text, bytes, bytes) == read_request(text, bytes, data[0] % (bytes + 1)));
    return 0;
}
