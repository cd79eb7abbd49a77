#include "protocol/json_scan.h"
#include "protocol/hex.h"
#include "protocol/utf8.h"
#include <assert.h>
#include <string.h>

#define MAX_DEPTH 64
#define MAX_NUMBER 60 /* characters; the tree's parser stops at 63 */

struct scan {
    const unsigned char *text;
    size_t at, bytes;
    struct pen_error *error;
};

static bool fail_at(struct scan *scan, const char *what)
{
    return pen_fail(
        scan->error, PEN_MALFORMED, "", "Malformed JSON at byte %zu: %s.", scan->at, what);
}

static int peek(const struct scan *scan)
{
    return scan->at < scan->bytes ? scan->text[scan->at] : -1;
}

static void skip_space(struct scan *scan)
{
    for (int c = peek(scan); c == ' ' || c == '\t' || c == '\n' || c == '\r'; c = peek(scan))
        scan->at++;
}

static bool is_digit(int c)
{
    return c >= '0' && c <= '9';
}

/* The four digits after "\u"; -1 when they are not four digits. */
static int scan_hex4(struct scan *scan)
{
    int value = 0;
    for (int i = 0; i < 4; i++, scan->at++) {
        int digit = pen_hex_digit(peek(scan));
        if (digit < 0)
            return -1;
        value = value * 16 + digit;
    }
    return value;
}

static bool scan_escape(struct scan *scan)
{
    scan->at++;
    int c = peek(scan);
    if (c < 0 || !strchr("\"\\/bfnrtu", c) || c == 0)
        return fail_at(scan, "unknown escape");
    scan->at++;
    if (c != 'u')
        return true;
    int unit = scan_hex4(scan);
    if (unit < 0)
        return fail_at(scan, "four hexadecimal digits expected");
    if (unit == 0)
        return fail_at(scan, "a string may not hold a NUL character");
    if (unit >= 0xdc00 && unit <= 0xdfff)
        return fail_at(scan, "unpaired surrogate");
    if (unit < 0xd800 || unit > 0xdbff)
        return true;
    if (peek(scan) != '\\')
        return fail_at(scan, "unpaired surrogate");
    scan->at++;
    if (peek(scan) != 'u')
        return fail_at(scan, "unpaired surrogate");
    scan->at++;
    unit = scan_hex4(scan);
    return (unit >= 0xdc00 && unit <= 0xdfff) || fail_at(scan, "unpaired surrogate");
}

static bool scan_string(struct scan *scan)
{
    for (scan->at++;;) {
        int c = peek(scan);
        if (c < 0)
            return fail_at(scan, "a string does not end");
        if (c < 0x20)
            return fail_at(scan, "control character in a string");
        if (c == '\\') {
            if (!scan_escape(scan))
                return false;
        } else if (c >= 0x80) {
            size_t length =
                pen_utf8_length((const char *)scan->text + scan->at, scan->bytes - scan->at);
            if (length == 0)
                return fail_at(scan, "not UTF-8");
            scan->at += length;
        } else {
            scan->at++;
            if (c == '"')
                return true;
        }
    }
}

static bool scan_digits(struct scan *scan)
{
    if (!is_digit(peek(scan)))
        return fail_at(scan, "a digit is expected");
    while (is_digit(peek(scan)))
        scan->at++;
    return true;
}

static bool scan_number(struct scan *scan)
{
    size_t start = scan->at;
    if (peek(scan) == '-')
        scan->at++;
    if (peek(scan) == '0')
        scan->at++;
    else if (!scan_digits(scan))
        return false;
    if (peek(scan) == '.') {
        scan->at++;
        if (!scan_digits(scan))
            return false;
    }
    if (peek(scan) == 'e' || peek(scan) == 'E') {
        scan->at++;
        if (peek(scan) == '+' || peek(scan) == '-')
            scan->at++;
        if (!scan_digits(scan))
            return false;
    }
    if (scan->at - start > MAX_NUMBER)
        return fail_at(scan, "a number has more than 60 characters");
    return true;
}

static bool scan_word(struct scan *scan, const char *word)
{
    size_t length = strlen(word);
    if (scan->bytes - scan->at < length || memcmp(scan->text + scan->at, word, length))
        return fail_at(scan, "a value is expected");
    scan->at += length;
    return true;
}

static bool scan_scalar(struct scan *scan)
{
    switch (peek(scan)) {
    case '"':
        return scan_string(scan);
    case 't':
        return scan_word(scan, "true");
    case 'f':
        return scan_word(scan, "false");
    case 'n':
        return scan_word(scan, "null");
    case -1:
        return fail_at(scan, "the text ends too early");
    default:
        if (peek(scan) != '-' && !is_digit(peek(scan)))
            return fail_at(scan, "a value is expected");
        return scan_number(scan);
    }
}

/* `"key" :` in front of a member's value. */
static bool scan_key(struct scan *scan)
{
    skip_space(scan);
    if (peek(scan) != '"')
        return fail_at(scan, "a key in double quotes is expected");
    if (!scan_string(scan))
        return false;
    skip_space(scan);
    if (peek(scan) != ':')
        return fail_at(scan, "':' is expected");
    scan->at++;
    return true;
}

bool pen_json_scan(const char *text, size_t bytes, unsigned max_depth, struct pen_error *error)
{
    assert(max_depth <= MAX_DEPTH);
    struct scan scan = {(const unsigned char *)text, 0, bytes, error};
    char closers[MAX_DEPTH]; /* what ends each open container */
    unsigned depth = 0;
    for (;;) {
        /* A value starts here. */
        skip_space(&scan);
        int c = peek(&scan);
        if (c == '{' || c == '[') {
            if (depth == max_depth)
                return pen_fail(error, PEN_MALFORMED, "",
                    "The JSON is nested more than %u deep at byte %zu.", max_depth, scan.at);
            closers[depth++] = c == '{' ? '}' : ']';
            scan.at++;
            skip_space(&scan);
            if (peek(&scan) != closers[depth - 1]) {
                if (c == '{' && !scan_key(&scan))
                    return false;
                continue;
            }
            scan.at++;
            depth--;
        } else if (!scan_scalar(&scan))
            return false;
        /* A value ended: close what ends with it, or go to the next one. */
        for (;;) {
            skip_space(&scan);
            if (depth == 0)
                return scan.at == bytes || fail_at(&scan, "text after the end of the document");
            c = peek(&scan);
            if (c == ',')
                break;
            if (c != closers[depth - 1])
                return fail_at(
                    &scan, c < 0 ? "the text ends too early" : "',' or an end is expected");
            scan.at++;
            depth--;
        }
        scan.at++;
        if (closers[depth - 1] == '}' && !scan_key(&scan))
            return false;
    }
}
