#include "server/uploads/multipart.h"
#include "protocol/memory.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#define MAX_BOUNDARY 70 /* RFC 2046 */
#define MAX_PART_HEADER 8192
#define BUFFER 65536
#define MAX_PARTS 8192

enum where { PREAMBLE, HEADERS, DATA, EPILOGUE };

struct multipart {
    struct multipart_sink sink;
    char mark[MAX_BOUNDARY + 8]; /* CR LF - - boundary */
    size_t mark_bytes;
    enum where where;
    bool wanted;    /* the part at hand is a file */
    uint32_t parts; /* so far */
    /* What has come and is not understood yet. Starts with CR LF, as if a line had ended, so that
     * the first boundary looks like all others. */
    char buffer[BUFFER];
    size_t used;
};

static bool find_parameter(const char *header, const char *name, char *value, size_t bytes)
{
    size_t length = strlen(name);
    for (const char *at = strchr(header, ';'); at;) {
        at++;
        at += strspn(at, " \t");
        bool match = !strncasecmp(at, name, length) && at[length] == '=';
        at += strcspn(at, "=;");
        if (*at != '=')
            at = *at ? at : NULL;
        else {
            size_t n = 0;
            if (at[1] == '"') {
                for (at += 2; *at && *at != '"'; at++) {
                    if (*at == '\\' && (at[1] == '"' || at[1] == '\\'))
                        at++;
                    if (match && n + 1 < bytes)
                        value[n++] = *at;
                    else if (match)
                        return false;
                }
                if (*at != '"')
                    return false;
                at++;
            } else {
                for (at++; *at && *at != ';' && *at != ' ' && *at != '\t'; at++) {
                    if (match && n + 1 < bytes)
                        value[n++] = *at;
                    else if (match)
                        return false;
                }
            }
            value[match ? n : 0] = 0;
            if (match)
                return true;
            at = strchr(at, ';');
        }
    }
    return false;
}

struct multipart *multipart_create(
    const char *content_type, const struct multipart_sink *sink, struct pen_error *error)
{
    struct multipart *m = pen_alloc_zero(1, sizeof *m);
    char boundary[MAX_BOUNDARY + 1];
    if (!find_parameter(content_type, "boundary", boundary, sizeof boundary) || !*boundary) {
        pen_fail(error, PEN_UNKNOWN_TYPE, "", "multipart/form-data needs a boundary.");
        free(m);
        return NULL;
    }
    m->sink = *sink;
    m->mark_bytes = (size_t)snprintf(m->mark, sizeof m->mark, "\r\n--%s", boundary);
    memcpy(m->buffer, "\r\n", 2);
    m->used = 2;
    return m;
}

void multipart_destroy(struct multipart *m)
{
    free(m);
}

static void consume(struct multipart *m, size_t bytes)
{
    memmove(m->buffer, m->buffer + bytes, m->used - bytes);
    m->used -= bytes;
}

/* The header block of one part, NUL-terminated lines joined by CR LF. */
static bool read_headers(struct multipart *m, char *block, struct pen_error *error)
{
    char name[512] = "", disposition[1024] = "";
    for (char *line = block; line && *line;) {
        char *end = strstr(line, "\r\n");
        if (end)
            *end = 0;
        if (!strncasecmp(line, "Content-Disposition:", 20)) {
            if (strlen(line + 20) >= sizeof disposition)
                return pen_fail(error, PEN_MALFORMED, "", "A part's header is too long.");
            strcpy(disposition, line + 20);
        } else if (!strncasecmp(line, "Content-Transfer-Encoding:", 26)) {
            const char *value = line + 26 + strspn(line + 26, " ");
            if (strcasecmp(value, "binary") && strcasecmp(value, "8bit") &&
                strcasecmp(value, "7bit"))
                return pen_fail(error, PEN_MALFORMED, "", "Parts cannot have a transfer encoding.");
        }
        line = end ? end + 2 : NULL;
    }
    const char *type = disposition + strspn(disposition, " \t");
    if (strncasecmp(type, "form-data", 9))
        return pen_fail(error, PEN_MALFORMED, "", "A part has no form-data disposition.");
    m->wanted = find_parameter(type, "filename", name, sizeof name) && *name;
    return !m->wanted || m->sink.begin(m->sink.context, name, error);
}

/* Takes one step; *progress is false when more input is needed. */
static bool step(struct multipart *m, bool *progress, struct pen_error *error)
{
    *progress = false;
    if (m->where == EPILOGUE) {
        m->used = 0;
        return true;
    }
    if (m->where == HEADERS) {
        /* The CR LF of the boundary's line still stands in front. */
        char *end = memmem(m->buffer, m->used, "\r\n\r\n", 4);
        if (!end) {
            if (m->used > MAX_PART_HEADER)
                return pen_fail(error, PEN_MALFORMED, "", "A part's header is too long.");
            return true;
        }
        if (memchr(m->buffer, 0, (size_t)(end - m->buffer)))
            return pen_fail(error, PEN_MALFORMED, "", "A part's header is malformed.");
        if (end == m->buffer || ++m->parts > MAX_PARTS)
            return pen_fail(error, PEN_MALFORMED, "",
                end == m->buffer ? "A part has no header." : "There are too many parts.");
        *end = 0;
        size_t bytes = (size_t)(end - m->buffer) + 4;
        if (!read_headers(m, m->buffer + 2, error))
            return false;
        consume(m, bytes);
        m->where = DATA;
        *progress = true;
        return true;
    }
    char *mark = memmem(m->buffer, m->used, m->mark, m->mark_bytes);
    size_t data =
        mark ? (size_t)(mark - m->buffer) : (m->used > m->mark_bytes ? m->used - m->mark_bytes : 0);
    if (data) {
        if (m->where == DATA && m->wanted && !m->sink.data(m->sink.context, m->buffer, data, error))
            return false;
        consume(m, data);
        *progress = true;
        return true;
    }
    if (!mark)
        return true;
    /* At a boundary: "--" ends the body, else blanks and CR LF end the line. */
    size_t at = m->mark_bytes;
    if (m->used < at + 2)
        return true;
    if (!memcmp(m->buffer + at, "--", 2)) {
        m->where = EPILOGUE;
        *progress = true;
        return true;
    }
    while (at < m->used && (m->buffer[at] == ' ' || m->buffer[at] == '\t'))
        at++;
    if (m->used < at + 2 && at - m->mark_bytes < 256)
        return true;
    if (m->used < at + 2 || memcmp(m->buffer + at, "\r\n", 2))
        return pen_fail(error, PEN_MALFORMED, "", "A boundary is malformed.");
    consume(m, at);
    m->where = HEADERS;
    *progress = true;
    return true;
}

bool multipart_add(struct multipart *m, const void *data, size_t bytes, struct pen_error *error)
{
    const char *at = data;
    while (bytes) {
        size_t n = sizeof m->buffer - m->used < bytes ? sizeof m->buffer - m->used : bytes;
        memcpy(m->buffer + m->used, at, n);
        m->used += n;
        at += n;
        bytes -= n;
        bool progress = true;
        while (progress)
            if (!step(m, &progress, error))
                return false;
    }
    return true;
}

bool multipart_end(const struct multipart *m, struct pen_error *error)
{
    if (m->where == EPILOGUE)
        return true;
    return pen_fail(error, PEN_MALFORMED, "", "The upload ends before its closing boundary.");
}
