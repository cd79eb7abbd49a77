/* The strict JSON check, text by text; and never looser than the tree's parser needs. */
#include "protocol/json_scan.h"
#include "tests/unit/check.h"
#include <cjson/cJSON.h>

static bool scan(const char *text, size_t bytes)
{
    struct pen_error error = {0};
    bool ok = pen_json_scan(text, bytes, 32, &error);
    CHECK(ok == (error.code == PEN_OK));
    return ok;
}

int main(void)
{
    static const char *const good[] = {"0", "-0", "-0.5e-10", "1E+2", "true", "false", "null",
        "\"\"", "[]", "{}", " [ 1 , [ ] , { } ] ", "{\"a\":{\"b\":[1,2]},\"c\":\"\\u00e9\\n\\/\"}",
        "\"\xc3\xa9\xe2\x82\xac\xf0\x9f\x98\x80\"", "\"\\ud83d\\ude00\"", "\t\r\n1\t\r\n",
        "\"\x7f\"", "[[],[]]", "1e999",
        "123456789012345678901234567890123456789012345678901234567890"};
    static const char *const bad[] = {"", " ", "01", "-", "-a", "+1", ".5", "1.", "1e", "1e+",
        "0x10", "NaN", "Infinity", "-Infinity", "tru", "truex", "nul", "'a'", "\"a", "\"\\x\"",
        "\"\\u12\"", "\"\\u12g4\"", "\"\\ud83d\"", "\"\\ud83dx\"", "\"\\ud83d\\n\"", "\"\\ude00\"",
        "\"\\ud83d\\u0041\"", "\"\\u0000\"", "\"\t\"", "\"\n\"", "\"\x01\"", "[", "]", "[1", "[1,",
        "[1,]", "[,1]", "[1 2]", "[1]]", "[}", "{", "{]", "{\"a\"", "{\"a\":", "{\"a\":1",
        "{\"a\":1,", "{\"a\":1,}", "{\"a\" 1}", "{a:1}", "{1:1}", "{\"a\":1 \"b\":2}", "{\"a\":1}}",
        "{,}", "1 2", "\xef\xbb\xbf{}", "{}\x0b", "\xa0{}", "[1]/**/", "\"\x80\"", "\"\xc0\x80\"",
        "\"\xc1\xbf\"", "\"\xe0\x80\x80\"", "\"\xed\xa0\x80\"", "\"\xf4\x90\x80\x80\"",
        "\"\xf8\x80\x80\x80\x80\"", "\"\xe2\x82\"", "\"\xff\"",
        "1234567890123456789012345678901234567890123456789012345678901"};
    for (size_t i = 0; i < sizeof good / sizeof *good; i++) {
        if (!scan(good[i], strlen(good[i])))
            fprintf(stderr, "refused: %s\n", good[i]), check_failures++;
        /* Every prefix of a container is refused. */
        if (good[i][0] == '{' || good[i][0] == '[')
            for (size_t n = 0; n < strlen(good[i]); n++)
                CHECK(!scan(good[i], n));
    }
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
        if (scan(bad[i], strlen(bad[i])))
            fprintf(stderr, "accepted: %s\n", bad[i]), check_failures++;
    CHECK(!scan("{}\0", 3) && !scan("[\0]", 3) && !scan("\"\0\"", 3));

    /* Depth counts open containers. */
    char nest[200];
    for (int depth = 1; depth <= 40; depth++) {
        memset(nest, '[', (size_t)depth);
        memset(nest + depth, ']', (size_t)depth);
        CHECK(scan(nest, (size_t)depth * 2) == (depth <= 32));
    }

    /* Random edits of a valid text: what the check accepts, the tree's parser accepts too. */
    const char *base = "{\"a\":[1,-2.5e3,\"x\\u00e9\\\"\",true],\"b\":{\"c\":null,\"d\":[]}}";
    uint32_t seed = 1, accepted = 0;
    for (int n = 0; n < 200000; n++) {
        static const char alphabet[] = "{}[],:\"\\u01e9.-+tfn \n\x80\xc3x";
        char text[128];
        size_t bytes = strlen(base);
        memcpy(text, base, bytes + 1);
        for (int edit = 0; edit < 1 + n % 3; edit++) {
            seed = seed * 1664525u + 1013904223u;
            size_t at = (seed >> 8) % bytes;
            text[at] = alphabet[(seed >> 20) % (sizeof alphabet - 1)];
        }
        if (!scan(text, bytes))
            continue;
        accepted++;
        cJSON *tree = cJSON_ParseWithLengthOpts(text, bytes + 1, NULL, true);
        if (!tree)
            fprintf(stderr, "the tree's parser refuses: %s\n", text), check_failures++;
        cJSON_Delete(tree);
    }
    CHECK(accepted > 1000);
    CHECK_DONE();
}
