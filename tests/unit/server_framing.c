/* The bytes of requests, in every division into pieces: the verdict is the same. */
#include "server/wire/framing.h"
#include "tests/unit/check.h"
#include <stdlib.h>
#include <string.h>

#define HEAD "POST /x HTTP/1.1\r\nHost: x\r\n"

/* Reads a request whose bytes come in two pieces; 0 and what was read, or the error's code. */
static uint32_t read_request(const char *text, size_t bytes, size_t cut, size_t *used)
{
    struct framing framing;
    struct pen_error error = {0};
    framing_init(&framing);
    size_t have = cut < bytes ? cut : bytes, at = 0;
    /* Each piece in memory of its own size, so that nothing is read beyond it. */
    for (int piece = 0; piece < 2; piece++, have = bytes) {
        char *copy = malloc(have + 1);
        memcpy(copy, text, have);
        char *exact = realloc(copy, have ? have : 1);
        if (framing.state == FRAMING_HEAD) {
            int64_t n = framing_head(&framing, exact, have, &error);
            at = n > 0 ? (size_t)n : 0;
        }
        if (framing.state != FRAMING_HEAD && error.code == PEN_OK) {
            int64_t n = framing_body(&framing, exact + at, have - at, &error);
            at += n > 0 ? (size_t)n : 0;
        }
        free(exact);
        if (error.code)
            return error.code;
    }
    *used = framing.state == FRAMING_OVER ? at : 0;
    return 0;
}

static void check(const char *text, size_t bytes, uint32_t code, size_t end)
{
    for (size_t cut = 0; cut <= bytes; cut++) {
        size_t used = 0;
        CHECK(read_request(text, bytes, cut, &used) == code);
        CHECK(code || used == end);
    }
}

/* A literal; `end` is where the next request begins. */
#define GOOD(text, behind) check(text behind, sizeof(text behind) - 1, 0, sizeof(text) - 1)
#define BAD(text, code) check(text, sizeof(text) - 1, code, 0)

int main(void)
{
    GOOD("GET / HTTP/1.1\r\nHost: x\r\n\r\n", "GET");
    GOOD("\r\nGET / HTTP/1.1\r\nHost: x\r\n\r\n", "\r\n");
    GOOD(HEAD "Content-Length: 3\r\n\r\nabc", "d");
    GOOD(HEAD "Content-Length: 0\r\n\r\n", "d");
    GOOD(HEAD "Transfer-Encoding: chunked\r\n\r\n3\r\nabc\r\n0\r\n\r\n", "0\r\n");
    GOOD(HEAD "Transfer-Encoding: chunked\r\n\r\n00000003;a=b\r\nabc\r\nA\r\n0123456789\r\n0\r\nX: "
              "y\r\n\r\n",
        "GET");
    GOOD(HEAD "Transfer-Encoding: chunked\r\n\r\n2\r\n\r\n\r\n0\r\n\r\n", "\r\n");
    BAD("GET / HTTP/1.1\nHost: x\n\n", PEN_MALFORMED);
    BAD("GET / HTTP/1.1\r\nHost: x\r\nA\0B: c\r\n\r\n", PEN_MALFORMED);
    BAD("\r\n\r\nGET / HTTP/1.1\r\nHost: x\r\n\r\n", PEN_MALFORMED);
    BAD(HEAD "Content-Length: 3\r\nContent-Length: 3\r\n\r\nabc", PEN_MALFORMED);
    BAD(HEAD "Transfer-Encoding: chunked\r\n\r\n000000003\r\nabc\r\n0\r\n\r\n", PEN_MALFORMED);
    BAD(HEAD "Transfer-Encoding: chunked\r\n\r\n3\r\nabcd\r\n0\r\n\r\n", PEN_MALFORMED);
    BAD(HEAD "Transfer-Encoding: chunked\r\n\r\n0\r\nX : y\r\n\r\n", PEN_MALFORMED);
    /* Kept open or not. */
    const struct {
        const char *text;
        bool closes;
    } kept[] = {
        {"GET / HTTP/1.1\r\nHost: x\r\n\r\n", false},
        {"GET / HTTP/1.1\r\nHost: x\r\nConnection: x, Close\r\n\r\n", true},
        {"GET / HTTP/1.0\r\n\r\n", true},
        {"GET / HTTP/1.0\r\nConnection: Keep-Alive\r\n\r\n", false},
        {"GET / HTTP/1.1\r\nHost: x\r\nConnection: closed\r\n\r\n", false},
    };
    for (size_t i = 0; i < sizeof kept / sizeof *kept; i++) {
        struct framing framing;
        struct pen_error error = {0};
        framing_init(&framing);
        CHECK(framing_head(&framing, kept[i].text, strlen(kept[i].text), &error) > 0);
        CHECK(framing.closes == kept[i].closes);
    }
    /* Limits hold before the end is there. */
    size_t bytes = 2 * FRAMING_MAX_HEAD;
    char *endless = malloc(bytes);
    memset(endless, 'a', bytes);
    memcpy(endless, "GET /", sizeof "GET /" - 1);
    size_t used;
    CHECK(read_request(endless, bytes, 100, &used) == PEN_URI_TOO_LONG);
    memcpy(endless, HEAD "A: ", sizeof HEAD - 1 + 3);
    CHECK(read_request(endless, bytes, 100, &used) == PEN_HEADER_TOO_BIG);
    free(endless);
    CHECK_DONE();
}
