/* The bytes of requests, in every division into pieces: the verdict is the same. */
#include "server/wire/framing.h"
#include "tests/unit/check.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define HEAD "POST /x HTTP/1.1\r\nHost: x\r\n"

/* What of a body is passed on. */
struct passed {
    char bytes[256];
    size_t count;
};

/* Reads a request whose bytes come in two pieces; 0 and what was read, or the error's code. */
static uint32_t read_request(
    const char *text, size_t bytes, size_t cut, size_t *used, struct passed *passed)
{
    passed->count = 0;
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
            size_t kept = 0;
            int64_t n = framing_body(&framing, exact + at, have - at, &kept, &error);
            CHECK(n < 0 || kept <= (size_t)n);
            for (size_t i = 0; n > 0 && i < kept && passed->count < sizeof passed->bytes; i++)
                passed->bytes[passed->count++] = exact[at + i];
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
    struct passed passed;
    for (size_t cut = 0; cut <= bytes; cut++) {
        size_t used = 0;
        CHECK(read_request(text, bytes, cut, &used, &passed) == code);
        CHECK(code || used == end);
    }
}

/* Of a body of chunks: extensions and the fields behind it are left out, and nothing else is. */
static void check_passed(const char *body, const char *expected)
{
    char text[512];
    struct passed passed;
    size_t used, bytes = (size_t)snprintf(text, sizeof text,
                     HEAD "Transfer-Encoding: chunked\r\n\r\n%s%s", body, "GET /");
    for (size_t cut = 0; cut <= bytes; cut++) {
        CHECK(read_request(text, bytes, cut, &used, &passed) == 0);
        CHECK(used == bytes - 5);
        CHECK(passed.count == strlen(expected) && !memcmp(passed.bytes, expected, passed.count));
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
    check_passed("3\r\nabc\r\n0\r\n\r\n", "3\r\nabc\r\n0\r\n\r\n");
    check_passed("3;a=\"b;c\"\r\na;b\r\n00 ; x\r\n\r\n", "3\r\na;b\r\n00\r\n\r\n");
    check_passed("2\t\r\n\r\n\r\nA;b\r\n0123456789\r\n0\r\nX: y\r\nZ:\r\n\r\n",
        "2\r\n\r\n\r\nA\r\n0123456789\r\n0\r\n\r\n");
    check_passed("0;x\r\nA: 3;b\r\n\r\n", "0\r\n\r\n");
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
    struct passed passed;
    CHECK(read_request(endless, bytes, 100, &used, &passed) == PEN_URI_TOO_LONG);
    memcpy(endless, HEAD "A: ", sizeof HEAD - 1 + 3);
    CHECK(read_request(endless, bytes, 100, &used, &passed) == PEN_HEADER_TOO_BIG);
    free(endless);
    CHECK_DONE();
}
