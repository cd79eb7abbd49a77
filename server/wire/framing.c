#include "server/wire/framing.h"
#include "protocol/hex.h"
#include <ctype.h>
#include <string.h>
#include <strings.h>

#define MAX_LENGTH_DIGITS 18
#define MAX_CHUNK_DIGITS 8

void framing_init(struct framing *f)
{
    memset(f, 0, sizeof *f);
}

static bool malformed(struct pen_error *error, const char *what)
{
    return pen_fail(error, PEN_MALFORMED, "", "%s", what);
}

static size_t token_bytes(const char *text, size_t bytes)
{
    size_t n = 0;
    while (n < bytes && text[n] &&
           (isalnum((unsigned char)text[n]) || strchr("!#$%&'*+-.^_`|~", text[n])))
        n++;
    return n;
}

static bool is_word(const char *text, size_t bytes, const char *word)
{
    return strlen(word) == bytes && !strncasecmp(text, word, bytes);
}

/* A name, a colon, and a value without control characters. The value's place is left in *value. */
static bool check_field(
    const char *line, size_t bytes, size_t *name_bytes, size_t *value, struct pen_error *error)
{
    if (bytes && (*line == ' ' || *line == '\t'))
        return malformed(error, "A header goes on in a second line.");
    size_t n = *name_bytes = token_bytes(line, bytes);
    if (!n || n == bytes || line[n] != ':')
        return malformed(error, "A header has an invalid name.");
    for (size_t i = n + 1; i < bytes; i++)
        if (((unsigned char)line[i] < 0x20 && line[i] != '\t') || line[i] == 0x7f)
            return malformed(error, "A header has a control character in its value.");
    *value = n + 1;
    while (*value < bytes && (line[*value] == ' ' || line[*value] == '\t'))
        ++*value;
    return true;
}

/* Fields that say one thing: two of them would be read otherwise by another. */
static const char *const single[] = {"Authorization", "Content-Type", "Idempotency-Key", "If-Range",
    "Last-Event-ID", "Origin", "Range", "Sec-Fetch-Site", "X-Forwarded-Host", "X-Forwarded-Prefix",
    "X-Forwarded-Proto"};

/* What the fields say about the body and the connection. */
struct fields {
    uint32_t seen; /* bits: of `single` */
    uint32_t count, lengths, encodings, hosts;
    uint64_t length;
    bool close, keep;
};

static bool read_length(const char *value, size_t bytes, uint64_t *length, struct pen_error *error)
{
    *length = 0;
    if (!bytes || bytes > MAX_LENGTH_DIGITS)
        return malformed(error, "Content-Length is not a number.");
    for (size_t i = 0; i < bytes; i++) {
        if (!isdigit((unsigned char)value[i]))
            return malformed(error, "Content-Length is not a number.");
        *length = *length * 10 + (uint64_t)(value[i] - '0');
    }
    return true;
}

static void read_connection(const char *value, size_t bytes, struct fields *fields)
{
    for (size_t at = 0; at < bytes; at++) {
        size_t n = token_bytes(value + at, bytes - at);
        fields->close = fields->close || is_word(value + at, n, "close");
        fields->keep = fields->keep || is_word(value + at, n, "keep-alive");
        at += n;
    }
}

static bool read_field(
    const char *line, size_t bytes, struct fields *fields, struct pen_error *error)
{
    size_t name, at;
    if (++fields->count > FRAMING_MAX_FIELDS)
        return pen_fail(error, PEN_HEADER_TOO_BIG, "", "The request has too many headers.");
    if (!check_field(line, bytes, &name, &at, error))
        return false;
    const char *value = line + at;
    size_t rest = bytes - at;
    while (rest && (value[rest - 1] == ' ' || value[rest - 1] == '\t'))
        rest--;
    if (is_word(line, name, "Content-Length")) {
        fields->lengths++;
        return read_length(value, rest, &fields->length, error);
    }
    if (is_word(line, name, "Transfer-Encoding")) {
        fields->encodings++;
        return is_word(value, rest, "chunked") ||
               malformed(error, "The only transfer coding is chunked.");
    }
    if (is_word(line, name, "Host")) {
        fields->hosts++;
        for (size_t i = 0; i < rest; i++)
            if (!isalnum((unsigned char)value[i]) && !strchr("-._~%!$&'()*+,;=:[]", value[i]))
                return malformed(error, "Host is not a name or an address.");
    }
    if (is_word(line, name, "Connection"))
        read_connection(value, rest, fields);
    for (uint32_t i = 0; i < sizeof single / sizeof *single; i++) {
        if (!is_word(line, name, single[i]))
            continue;
        if (fields->seen >> i & 1)
            return malformed(error, "A header that may be there once is there twice.");
        fields->seen |= 1u << i;
    }
    return true;
}

struct request_line {
    const char *method;
    size_t method_bytes;
    bool http11;
};

static bool read_request_line(
    const char *line, size_t bytes, struct request_line *request, struct pen_error *error)
{
    static const char version[] = " HTTP/1.";
    size_t n = token_bytes(line, bytes), tail = sizeof version; /* with the digit behind it */
    if (!n || n > 31 || n == bytes || line[n] != ' ')
        return malformed(error, "The request begins with no method.");
    if (bytes < n + 1 + tail || memcmp(line + bytes - tail, version, tail - 1))
        return malformed(error, "The request line does not end in an HTTP version.");
    if (line[bytes - 1] != '0' && line[bytes - 1] != '1')
        return malformed(error, "The HTTP version is not supported.");
    size_t target = bytes - tail - (n + 1);
    if (!target)
        return malformed(error, "The request has no target.");
    if (target > FRAMING_MAX_TARGET)
        return pen_fail(error, PEN_URI_TOO_LONG, "", "The request target is too long.");
    for (const char *c = line + n + 1; c < line + n + 1 + target; c++)
        if (*c <= 0x20 || *c >= 0x7f || *c == '#')
            return malformed(error, "The request target is malformed.");
    *request = (struct request_line){line, n, line[bytes - 1] == '1'};
    return true;
}

static bool judge(struct framing *f, const struct request_line *request,
    const struct fields *fields, struct pen_error *error)
{
    const char *method = request->method;
    size_t n = request->method_bytes;
    bool can_have_body =
        is_word(method, n, "POST") || is_word(method, n, "PUT") || is_word(method, n, "PATCH");
    if (fields->lengths > 1)
        return malformed(error, "There is more than one Content-Length.");
    if (fields->encodings && (fields->lengths || fields->encodings > 1 || !request->http11))
        return malformed(error, "The length of the body is ambiguous.");
    if (fields->hosts > 1 || (request->http11 && !fields->hosts))
        return malformed(error, "There must be exactly one Host.");
    if (!can_have_body && (fields->encodings || fields->length))
        return malformed(error, "This method has no body.");
    f->closes = fields->close || (!request->http11 && !fields->keep);
    f->left = fields->length;
    f->state = fields->encodings ? FRAMING_CHUNK_LINE
               : fields->length  ? FRAMING_LENGTH
                                 : FRAMING_OVER;
    return true;
}

/* Looks at bytes as they come, so that what is wrong is not waited for. The header's end, 0: not yet,
 * -1: an error. */
static int64_t scan(struct framing *f, const char *text, size_t bytes, struct pen_error *error)
{
    for (; f->scanned < bytes; f->scanned++) {
        size_t i = f->scanned;
        if (text[i] == 0)
            return malformed(error, "The request has a NUL in its header."), -1;
        if (text[i] != '\r' && text[i] != '\n')
            continue;
        if (text[i] == '\n' && (!i || text[i - 1] != '\r'))
            return malformed(error, "A line does not end in CR and LF."), -1;
        if (text[i] == '\r') {
            if (i + 1 == bytes)
                return 0; /* what follows will say */
            if (text[i + 1] != '\n')
                return malformed(error, "A line has a CR that does not end it."), -1;
            continue;
        }
        if (i == f->blank + 1) {
            if (f->blank == 2)
                return malformed(error, "The request begins with empty lines."), -1;
            f->blank += 2; /* one is overlooked, as old clients send it behind a body */
        } else if (i >= f->blank + 3 && text[i - 2] == '\n') {
            return (int64_t)++f->scanned;
        }
    }
    return 0;
}

int64_t framing_head(struct framing *f, const char *text, size_t bytes, struct pen_error *error)
{
    int64_t end = scan(f, text, bytes, error);
    size_t have = end > 0 ? (size_t)end : bytes;
    if (end < 0)
        return -1;
    const char *line = text + f->blank, *limit = text + have;
    const char *line_end = have > f->blank ? memchr(line, '\r', have - f->blank) : NULL;
    if ((size_t)((line_end ? line_end : limit) - line) > FRAMING_MAX_TARGET + 64)
        return pen_fail(error, PEN_URI_TOO_LONG, "", "The request target is too long."), -1;
    if (have > FRAMING_MAX_HEAD)
        return pen_fail(error, PEN_HEADER_TOO_BIG, "", "The header is larger than %u bytes.",
                   FRAMING_MAX_HEAD),
               -1;
    if (!end)
        return 0;
    struct request_line request = {0};
    struct fields fields = {0};
    if (!read_request_line(line, (size_t)(line_end - line), &request, error))
        return -1;
    for (line = line_end + 2; *line != '\r'; line = line_end + 2) {
        line_end = memchr(line, '\r', (size_t)(limit - line));
        if (!read_field(line, (size_t)(line_end - line), &fields, error))
            return -1;
    }
    return judge(f, &request, &fields, error) ? end : -1;
}

void framing_veil(char *head, size_t bytes)
{
    char *end = head + bytes, *line_end = memchr(head, '\r', bytes);
    char *mark = memchr(head, '?', (size_t)(line_end - head));
    if (mark)
        *mark = FRAMING_QUERY;
    for (char *line = line_end + 2; line < end && *line != '\r'; line = line_end + 2) {
        line_end = memchr(line, '\r', (size_t)(end - line));
        if (is_word(line, token_bytes(line, (size_t)(line_end - line)), "Cookie"))
            *line = '-';
    }
}

/* ---- chunks ---- */

/* One byte of "1f;name=value" and the line's end. */
static bool read_chunk_line(struct framing *f, char c, struct pen_error *error)
{
    int digit = pen_hex_digit(c);
    if (f->cr) {
        if (c != '\n')
            return malformed(error, "The size of a chunk does not end in CR and LF.");
        f->state = f->left ? FRAMING_CHUNK : FRAMING_TRAILER;
        f->line_bytes = f->digits = 0;
        f->extension = f->cr = false;
        return true;
    }
    if (++f->line_bytes == FRAMING_MAX_LINE)
        return malformed(error, "The line of a chunk's size is too long.");
    f->cr = c == '\r' && f->digits;
    if (f->cr)
        return true;
    if (f->extension)
        return ((unsigned char)c >= 0x20 && c != 0x7f) || c == '\t' ||
               malformed(error, "The line of a chunk's size has a control character.");
    f->extension = f->digits && (c == ';' || c == ' ' || c == '\t');
    if (f->extension)
        return true;
    if (digit < 0 || f->digits == MAX_CHUNK_DIGITS)
        return malformed(error, "The size of a chunk is not a number of at most eight digits.");
    f->left = (f->digits++ ? f->left << 4 : 0) | (uint64_t)digit;
    return true;
}

/* One byte of the fields behind the last chunk. */
static bool read_trailer(struct framing *f, char c, struct pen_error *error)
{
    if (f->line_bytes == FRAMING_MAX_LINE)
        return pen_fail(error, PEN_HEADER_TOO_BIG, "", "A field behind the body is too long.");
    bool after_cr = f->line_bytes && f->line[f->line_bytes - 1] == '\r';
    if (after_cr != (c == '\n'))
        return malformed(error, "A line behind the body does not end in CR and LF.");
    f->line[f->line_bytes++] = c;
    if (c != '\n')
        return true;
    size_t name, value, bytes = f->line_bytes - 2;
    f->line_bytes = 0;
    if (!bytes) {
        f->state = FRAMING_OVER;
        return true;
    }
    if (++f->trailers > FRAMING_MAX_FIELDS)
        return pen_fail(
            error, PEN_HEADER_TOO_BIG, "", "There are too many fields behind the body.");
    return check_field(f->line, bytes, &name, &value, error);
}

/* Of what stands between the chunks only their sizes and the last empty line are passed on. */
static bool is_passed_on(const struct framing *f, enum framing_state state, char c)
{
    if (state == FRAMING_TRAILER)
        return c == '\n' ? f->state == FRAMING_OVER : c == '\r' && f->line_bytes == 1;
    return state != FRAMING_CHUNK_LINE || !f->extension || c == '\r';
}

int64_t framing_body(
    struct framing *f, char *data, size_t bytes, size_t *kept, struct pen_error *error)
{
    size_t i = 0, to = 0;
    while (i < bytes && f->state != FRAMING_OVER) {
        enum framing_state state = f->state;
        if (state == FRAMING_LENGTH || state == FRAMING_CHUNK) {
            uint64_t n = bytes - i < f->left ? bytes - i : f->left;
            if (to < i)
                memmove(data + to, data + i, n);
            i += n;
            to += n;
            f->left -= n;
            if (!f->left)
                f->state = state == FRAMING_LENGTH ? FRAMING_OVER : FRAMING_CHUNK_END;
            continue;
        }
        char c = data[i++];
        if (state == FRAMING_CHUNK_END) {
            if (c != (f->cr ? '\n' : '\r'))
                return malformed(error, "A chunk does not end where its size says."), -1;
            f->state = f->cr ? FRAMING_CHUNK_LINE : FRAMING_CHUNK_END;
            f->cr = !f->cr;
        } else if (state == FRAMING_CHUNK_LINE ? !read_chunk_line(f, c, error)
                                               : !read_trailer(f, c, error)) {
            return -1;
        }
        if (is_passed_on(f, state, c))
            data[to++] = c;
    }
    *kept = to;
    return (int64_t)i;
}
