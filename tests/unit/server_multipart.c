/* Form bodies cut in every way, against what was put in; and broken ones. */
#include "server/uploads/multipart.h"
#include "tests/unit/check.h"

static struct {
    char names[8][64];
    char data[8][4096];
    size_t bytes[8];
    int count;
} got;

static bool begin(void *context, const char *name, struct pen_error *error)
{
    (void)context;
    if (!strcmp(name, "refused"))
        return pen_fail(error, PEN_INVALID, "", "Not this one.");
    snprintf(got.names[got.count++], sizeof got.names[0], "%s", name);
    return true;
}

static bool data(void *context, const void *bytes, size_t count, struct pen_error *error)
{
    (void)context, (void)error;
    memcpy(got.data[got.count - 1] + got.bytes[got.count - 1], bytes, count);
    got.bytes[got.count - 1] += count;
    return true;
}

static const struct multipart_sink sink = {begin, data, NULL};

/* Feeds `text` in pieces of `piece` bytes; returns the code of the failure, or 0. */
static uint32_t feed(const char *type, const char *text, size_t bytes, size_t piece)
{
    struct pen_error error = {0};
    memset(&got, 0, sizeof got);
    struct multipart *m = multipart_create(type, &sink, &error);
    if (!m)
        return error.code;
    bool ok = true;
    for (size_t at = 0; ok && at < bytes; at += piece)
        ok = multipart_add(m, text + at, piece < bytes - at ? piece : bytes - at, &error);
    if (ok)
        multipart_end(m, &error);
    multipart_destroy(m);
    return error.code;
}

#define TYPE "multipart/form-data; boundary=xYz"
#define PART(name) "Content-Disposition: form-data; name=\"f\"; filename=\"" name "\"\r\n\r\n"

static void test_pieces(void)
{
    static const char body[] = "to be ignored\r\n--xYz\r\n" PART(
        "a.bin") "first\r\n--xY\r\n\r\n"
                 "--xYz  \t\r\nContent-Type: text/plain\r\ncontent-disposition: "
                 "form-data; name=comment\r\n\r\nno file\r\n--xYz\r\n" PART(
                     "empty") "\r\n--xYz\r\n" PART("b \\\"q\\\".gltf") "\r\n\r\n--\r\n-\r\n--xYz--"
                                                                       "\r\nbehind";
    for (size_t piece = 1; piece < sizeof body; piece++) {
        CHECK(feed(TYPE, body, sizeof body - 1, piece) == 0);
        CHECK(got.count == 3);
        CHECK_STR(got.names[0], "a.bin");
        CHECK_STR(got.names[1], "empty");
        CHECK_STR(got.names[2], "b \"q\".gltf");
        CHECK_STR(got.data[0], "first\r\n--xY\r\n");
        CHECK(got.bytes[1] == 0);
        CHECK_STR(got.data[2], "\r\n\r\n--\r\n-");
    }
    /* Without anything in front of the first boundary, and with a quoted one. */
    static const char bare[] = "--xYz\r\n" PART("a") "1\r\n--xYz--";
    CHECK(feed("multipart/form-data; charset=utf-8; boundary=\"xYz\"", bare, sizeof bare - 1, 7) ==
          0);
    CHECK_STR(got.data[0], "1");
}

static void test_broken(void)
{
    static const struct {
        const char *type, *body;
        uint32_t code;
    } rows[] = {
        {"multipart/form-data", "", PEN_UNKNOWN_TYPE},
        {"multipart/form-data; boundary=", "", PEN_UNKNOWN_TYPE},
        {"multipart/form-data; boundary=\"x", "", PEN_UNKNOWN_TYPE},
        {"multipart/form-data; notboundary=x", "", PEN_UNKNOWN_TYPE},
        {"multipart/form-data; "
         "boundary=xxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxx",
            "", PEN_UNKNOWN_TYPE},
        {TYPE, "", PEN_MALFORMED},
        {TYPE, "nothing here", PEN_MALFORMED},
        {TYPE, "--xYz\r\n" PART("a") "1", PEN_MALFORMED},
        {TYPE, "--xYz\r\n" PART("a") "1\r\n--xYz-", PEN_MALFORMED},
        {TYPE, "--xYz\r\n\r\nno header\r\n--xYz--", PEN_MALFORMED},
        {TYPE, "--xYz\r\nContent-Type: a/b\r\n\r\n1\r\n--xYz--", PEN_MALFORMED},
        {TYPE, "--xYzz\r\n" PART("a") "1\r\n--xYz--", PEN_MALFORMED},
        {TYPE, "--xYz\r\nContent-Transfer-Encoding: base64\r\n" PART("a") "1\r\n--xYz--",
            PEN_MALFORMED},
        {TYPE, "--xYz\r\n" PART("refused") "1\r\n--xYz--", PEN_INVALID},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++)
        for (size_t piece = 1; piece < 40; piece += 6)
            CHECK(feed(rows[i].type, rows[i].body, strlen(rows[i].body), piece) == rows[i].code);
    /* A header without an end is refused long before memory runs out. */
    static char long_header[100000] = "--xYz\r\nX: ";
    memset(long_header + 10, 'a', sizeof long_header - 10);
    CHECK(feed(TYPE, long_header, sizeof long_header, 1000) == PEN_MALFORMED);
}

int main(void)
{
    test_pieces();
    test_broken();
    CHECK_DONE();
}
