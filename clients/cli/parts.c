#include "clients/cli/parts.h"
#include "clients/cli/output.h"
#include "protocol/memory.h"
#include <stdlib.h>
#include <string.h>

#define MAX_MARK 128 /* a line break, two dashes and the boundary */

struct parts {
    const char *path;
    char *
        bytes; /* what came and is not taken yet; begins with a line break, as each boundary does */
    size_t count, capacity, seen; /* seen: no boundary begins before it */
    char mark[MAX_MARK];
    size_t mark_bytes;
    bool in_header, ended, failed;
    char type[96]; /* of the part whose bytes come */
    char *problem; /* what the server says went wrong */
    uint32_t pictures;
};

static void drop(struct parts *p, size_t bytes)
{
    memmove(p->bytes, p->bytes + bytes, p->count - bytes);
    p->count -= bytes;
    p->seen = 0;
}

static bool write_file(const char *path, const char *bytes, size_t count)
{
    struct cli_output output;
    int status = cli_output_open(&output, path);
    if (status == CLI_OK)
        fwrite(bytes, 1, count, output.file);
    return cli_output_end(&output, status) == CLI_OK;
}

/* A part is whole. */
static void take(struct parts *p, size_t bytes, bool is_last)
{
    if (!strncmp(p->type, "image/", 6) && bytes) {
        p->pictures++;
        if (is_last || strcmp(p->path, "-"))
            p->failed = !write_file(p->path, p->bytes, bytes);
    } else if (!strcmp(p->type, "application/problem+json") && !p->problem) {
        p->problem = cli_format("%.*s", (int)bytes, p->bytes);
    }
}

static char *find(struct parts *p, const char *what, size_t bytes)
{
    size_t from = p->seen > bytes ? p->seen - bytes : 0;
    char *at = p->count > from ? memmem(p->bytes + from, p->count - from, what, bytes) : NULL;
    p->seen = p->count;
    return at;
}

/* Behind a boundary: the closing dashes, or a header. */
static bool read_header(struct parts *p)
{
    static const char name[] = "Content-Type: ";
    if (p->count >= 2 && !memcmp(p->bytes, "--", 2)) {
        p->ended = true;
        return false;
    }
    char *end = find(p, "\r\n\r\n", 4);
    if (!end)
        return false;
    *end = 0;
    const char *type = strstr(p->bytes, name);
    snprintf(p->type, sizeof p->type, "%s", type ? type + strlen(name) : "");
    p->type[strcspn(p->type, "\r\n;")] = 0;
    drop(p, (size_t)(end - p->bytes) + 4);
    p->in_header = false;
    return true;
}

static bool read_body(struct parts *p)
{
    char *end = find(p, p->mark, p->mark_bytes);
    size_t bytes = end ? (size_t)(end - p->bytes) : 0;
    /* What follows says whether it was the last. */
    if (!end || p->count < bytes + p->mark_bytes + 2) {
        p->seen = bytes;
        return false;
    }
    take(p, bytes, !memcmp(end + p->mark_bytes, "--", 2));
    drop(p, bytes + p->mark_bytes);
    p->in_header = true;
    return !p->failed;
}

/* The first line is the boundary. */
static bool read_mark(struct parts *p)
{
    char *end = p->count > 2 ? memmem(p->bytes + 2, p->count - 2, "\r\n", 2) : NULL;
    size_t bytes = end ? (size_t)(end - p->bytes) : p->count;
    if (bytes > MAX_MARK)
        p->failed = cli_fail(CLI_SERVER, "The server's answer cannot be read.");
    if (!end || p->failed)
        return false;
    memcpy(p->mark, p->bytes, bytes);
    p->mark_bytes = bytes;
    drop(p, bytes);
    p->in_header = true;
    return true;
}

static ssize_t receive(void *cookie, const char *data, size_t bytes)
{
    struct parts *p = cookie;
    p->bytes = pen_grow(p->bytes, &p->capacity, p->count + bytes, 1);
    memcpy(p->bytes + p->count, data, bytes);
    p->count += bytes;
    bool more = !p->ended && !p->failed;
    while (more)
        more = !p->mark_bytes ? read_mark(p) : p->in_header ? read_header(p) : read_body(p);
    return p->failed ? 0 : (ssize_t)bytes;
}

int cli_save_parts(const struct cli_server *server, struct cli_call *call, const char *path,
    struct cli_answer *answer)
{
    struct parts p = {.path = path};
    receive(&p, "\r\n", 2);
    FILE *sink = fopencookie(&p, "w", (cookie_io_functions_t){.write = receive});
    if (!sink)
        abort();
    setvbuf(sink, NULL, _IONBF, 0);
    call->sink = sink;
    int status = cli_call(server, call, answer);
    fclose(sink);
    if (!p.in_header && !strncmp(p.type, "application/", 12))
        take(&p, p.count, false); /* a problem is the end, without a boundary behind it */
    if (p.failed)
        status = CLI_FAILED;
    else if (p.problem) {
        cJSON *problem = cJSON_Parse(p.problem);
        const cJSON *detail = cJSON_GetObjectItemCaseSensitive(problem, "detail");
        status = cli_fail(CLI_SERVER, "It got no better than the %u. picture: %s", p.pictures,
            cJSON_IsString(detail) ? detail->valuestring : "");
        cJSON_Delete(problem);
    } else if (status == CLI_OK && !p.ended)
        status = cli_fail(CLI_SERVER, "The server's answer ends too early.");
    if (server->verbose)
        fprintf(stderr, "%u pictures\n", p.pictures);
    free(p.bytes);
    free(p.problem);
    return status;
}
