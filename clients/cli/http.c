#include "clients/cli/http.h"
#include "protocol/memory.h"
#include <curl/curl.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <time.h>
#include <unistd.h>

#define MAX_TEXT (64u << 20) /* bytes of an answer that is kept in memory */
#define MAX_RETRY_AFTER_S 30
#define CONNECT_TIMEOUT_S 10

struct transfer {
    CURL *curl;
    const struct cli_call *call;
    struct cli_answer *answer;
    size_t capacity;
    bool show; /* progress */
    bool shown;
    double started_s, last_s;
};

static double now_s(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static size_t on_body(char *data, size_t one, size_t bytes, void *user)
{
    (void)one;
    struct transfer *transfer = user;
    struct cli_answer *answer = transfer->answer;
    long status = 0;
    curl_easy_getinfo(transfer->curl, CURLINFO_RESPONSE_CODE, &status);
    if (transfer->call->sink && status >= 200 && status < 300) {
        answer->bytes += bytes;
        return fwrite(data, 1, bytes, transfer->call->sink);
    }
    if (answer->bytes + bytes > MAX_TEXT)
        return 0;
    answer->text = pen_grow(answer->text, &transfer->capacity, answer->bytes + bytes + 1, 1);
    memcpy(answer->text + answer->bytes, data, bytes);
    answer->bytes += bytes;
    answer->text[answer->bytes] = 0;
    return bytes;
}

/* Copies a header's value when the line is that header's. */
static bool header_value(
    const char *line, size_t bytes, const char *name, char *value, size_t value_bytes)
{
    size_t length = strlen(name);
    if (bytes <= length || strncasecmp(line, name, length) || line[length] != ':')
        return false;
    const char *from = line + length + 1, *end = line + bytes;
    while (from < end && (*from == ' ' || *from == '\t'))
        from++;
    while (end > from && (unsigned char)end[-1] <= ' ')
        end--;
    snprintf(value, value_bytes, "%.*s", (int)(end - from), from);
    return true;
}

static size_t on_header(char *line, size_t one, size_t bytes, void *user)
{
    (void)one;
    struct cli_answer *answer = ((struct transfer *)user)->answer;
    char value[256];
    if (header_value(line, bytes, "Retry-After", value, sizeof value)) {
        char *end;
        double seconds = strtod(value, &end);
        if (end != value && !*end && seconds >= 0) /* a date is not worth parsing here */
            answer->retry_after_s = seconds;
    }
    if (header_value(line, bytes, "X-Penumbra-Warning", value, sizeof value)) {
        char *longer = cli_format("%s%s\n", answer->warnings ? answer->warnings : "", value);
        free(answer->warnings);
        answer->warnings = longer;
    }
    header_value(line, bytes, "X-Penumbra-Choice", answer->choice, sizeof answer->choice);
    header_value(line, bytes, "Content-Type", answer->type, sizeof answer->type);
    header_value(line, bytes, "Location", answer->location, sizeof answer->location);
    header_value(line, bytes, "Server-Timing", answer->timing, sizeof answer->timing);
    return bytes;
}

static int on_progress(
    void *user, curl_off_t down_total, curl_off_t down, curl_off_t up_total, curl_off_t up)
{
    (void)down_total, (void)down;
    struct transfer *transfer = user;
    double now = now_s(), elapsed = now - transfer->started_s;
    if (!transfer->show || elapsed < 0.5 || now - transfer->last_s < 0.1)
        return 0;
    transfer->last_s = now;
    transfer->shown = true;
    if (up_total > 65536 && up < up_total)
        fprintf(stderr, "\r%s: %.1f of %.1f MB (%.0f %%)\033[K", transfer->call->doing,
            (double)up / 1e6, (double)up_total / 1e6, 100. * (double)up / (double)up_total);
    else
        fprintf(stderr, "\r%s: %.1f s\033[K", transfer->call->doing, elapsed);
    return 0;
}

static size_t read_file(char *data, size_t one, size_t bytes, void *user)
{
    size_t got = fread(data, one, bytes, user);
    return got == 0 && ferror((FILE *)user) ? CURL_READFUNC_ABORT : got;
}

static int seek_file(void *user, curl_off_t offset, int origin)
{
    return fseeko(user, offset, origin) ? CURL_SEEKFUNC_CANTSEEK : CURL_SEEKFUNC_OK;
}

static curl_mime *make_parts(CURL *curl, const struct cli_call *call)
{
    curl_mime *mime = curl_mime_init(curl);
    for (uint32_t i = 0; i < call->part_count; i++) {
        curl_mimepart *part = curl_mime_addpart(mime);
        curl_mime_name(part, "file");
        curl_mime_filedata(part, call->parts[i].path);
        curl_mime_filename(part, call->parts[i].name);
        curl_mime_type(part, call->parts[i].type);
    }
    return mime;
}

static struct curl_slist *make_headers(const struct cli_call *call)
{
    char line[600];
    const char *token = getenv("PENUMBRA_TOKEN");
    snprintf(line, sizeof line, "Accept: %s", call->accept ? call->accept : "application/json");
    struct curl_slist *headers = curl_slist_append(NULL, line);
    if (call->content_type) {
        snprintf(line, sizeof line, "Content-Type: %s", call->content_type);
        headers = curl_slist_append(headers, line);
    }
    if (token && *token) {
        snprintf(line, sizeof line, "Authorization: Bearer %.500s", token);
        headers = curl_slist_append(headers, line);
    }
    return headers;
}

/* A proxy from the environment must not come between us and this machine. */
static bool is_loopback(const char *base)
{
    const char *host = strstr(base, "://");
    host = host ? host + 3 : base;
    return !strncmp(host, "127.", 4) || !strncmp(host, "localhost", 9) ||
           !strncmp(host, "[::1]", 5);
}

static CURLcode perform(const struct cli_server *server, struct transfer *transfer, char *message)
{
    const struct cli_call *call = transfer->call;
    CURL *curl = transfer->curl;
    char *url = cli_format("%s%s", server->base, call->path);
    struct curl_slist *headers = make_headers(call);
    curl_mime *mime = NULL;
    curl_easy_setopt(curl, CURLOPT_URL, url);
    curl_easy_setopt(curl, CURLOPT_PROTOCOLS_STR, "http,https");
    curl_easy_setopt(curl, CURLOPT_CUSTOMREQUEST, call->method);
    curl_easy_setopt(curl, CURLOPT_USERAGENT, "penumbra/" PENUMBRA_VERSION);
    curl_easy_setopt(curl, CURLOPT_CONNECTTIMEOUT, (long)CONNECT_TIMEOUT_S);
    curl_easy_setopt(curl, CURLOPT_NOSIGNAL, 1L);
    curl_easy_setopt(curl, CURLOPT_ERRORBUFFER, message);
    curl_easy_setopt(curl, CURLOPT_HEADERFUNCTION, on_header);
    curl_easy_setopt(curl, CURLOPT_HEADERDATA, transfer);
    curl_easy_setopt(curl, CURLOPT_WRITEFUNCTION, on_body);
    curl_easy_setopt(curl, CURLOPT_WRITEDATA, transfer);
    curl_easy_setopt(curl, CURLOPT_NOPROGRESS, 0L);
    curl_easy_setopt(curl, CURLOPT_XFERINFOFUNCTION, on_progress);
    curl_easy_setopt(curl, CURLOPT_XFERINFODATA, transfer);
    if (is_loopback(server->base))
        curl_easy_setopt(curl, CURLOPT_PROXY, "");
    if (call->body) {
        curl_easy_setopt(curl, CURLOPT_POSTFIELDSIZE_LARGE, (curl_off_t)strlen(call->body));
        curl_easy_setopt(curl, CURLOPT_POSTFIELDS, call->body);
    } else if (call->file) {
        rewind(call->file);
        curl_easy_setopt(curl, CURLOPT_UPLOAD, 1L);
        curl_easy_setopt(curl, CURLOPT_READFUNCTION, read_file);
        curl_easy_setopt(curl, CURLOPT_READDATA, call->file);
        curl_easy_setopt(curl, CURLOPT_SEEKFUNCTION, seek_file);
        curl_easy_setopt(curl, CURLOPT_SEEKDATA, call->file);
        curl_easy_setopt(curl, CURLOPT_INFILESIZE_LARGE, (curl_off_t)call->file_bytes);
    } else if (call->part_count) {
        mime = make_parts(curl, call);
        curl_easy_setopt(curl, CURLOPT_MIMEPOST, mime);
    }
    curl_easy_setopt(curl, CURLOPT_HTTPHEADER, headers);
    CURLcode code = curl_easy_perform(curl);
    curl_easy_getinfo(curl, CURLINFO_RESPONSE_CODE, &transfer->answer->status);
    curl_mime_free(mime);
    curl_slist_free_all(headers);
    free(url);
    return code;
}

/* One attempt. Returns CLI_OK when there is an answer, whatever its status. */
static int attempt(
    const struct cli_server *server, const struct cli_call *call, struct cli_answer *answer)
{
    char message[CURL_ERROR_SIZE] = "";
    struct transfer transfer = {.call = call,
        .answer = answer,
        .show = call->doing && isatty(STDERR_FILENO),
        .started_s = now_s(),
        .curl = curl_easy_init()};
    if (!transfer.curl)
        return cli_fail(CLI_FAILED, "libcurl does not start.");
    CURLcode code = perform(server, &transfer, message);
    curl_easy_cleanup(transfer.curl);
    if (transfer.shown)
        fputs("\r\033[K", stderr);
    if (server->verbose)
        fprintf(stderr, "%s %s%s: %ld, %.0f ms\n", call->method, server->base, call->path,
            answer->status, 1e3 * (now_s() - transfer.started_s));
    if (code == CURLE_OK)
        return CLI_OK;
    /* A server that refuses an upload early may close before it was read to its end. */
    if (answer->status >= 400)
        return CLI_OK;
    if (code == CURLE_WRITE_ERROR || code == CURLE_READ_ERROR || code == CURLE_ABORTED_BY_CALLBACK)
        return cli_fail(CLI_FAILED, "%s", message[0] ? message : curl_easy_strerror(code));
    return cli_fail(CLI_NO_CONNECTION, "No answer from %s: %s.", server->base,
        message[0] ? message : curl_easy_strerror(code));
}

static const char *text_member(const cJSON *object, const char *key)
{
    const cJSON *item = cJSON_GetObjectItemCaseSensitive(object, key);
    return cJSON_IsString(item) ? item->valuestring : NULL;
}

/* Says in words what a problem document says. */
static int report(const struct cli_server *server, const struct cli_answer *answer)
{
    int code = answer->status >= 500 ? CLI_SERVER : CLI_REFUSED;
    cJSON *problem = answer->text ? cJSON_Parse(answer->text) : NULL;
    const char *title = text_member(problem, "title"), *detail = text_member(problem, "detail");
    const char *pointer = text_member(problem, "pointer");
    const char *request_id = text_member(problem, "request_id");
    if (title || detail)
        cli_fail(code, "%s (%ld): %s%s%s%s", title ? title : "The server refuses", answer->status,
            detail ? detail : "", pointer && *pointer ? " [at " : "", pointer ? pointer : "",
            pointer && *pointer ? "]" : "");
    else
        cli_fail(code, "The server answered %ld: %.200s", answer->status,
            answer->text ? answer->text : "");
    if (request_id && server->verbose)
        fprintf(stderr, "request id: %s\n", request_id);
    cJSON_Delete(problem);
    return code;
}

static bool is_worth_retrying(const struct cli_answer *answer)
{
    return answer->status == 503 || answer->status == 429;
}

int cli_call(
    const struct cli_server *server, const struct cli_call *call, struct cli_answer *answer)
{
    for (int tries = 0;; tries++) {
        *answer = (struct cli_answer){.retry_after_s = -1};
        int status = attempt(server, call, answer);
        if (status != CLI_OK)
            return status;
        if (!is_worth_retrying(answer) || tries == server->retries)
            break;
        double wait_s = answer->retry_after_s < 0 ? 1 : answer->retry_after_s;
        if (wait_s > MAX_RETRY_AFTER_S)
            break;
        if (server->verbose || isatty(STDERR_FILENO))
            fprintf(stderr, "The server is busy; trying again in %g s.\n", wait_s);
        usleep((useconds_t)(wait_s * 1e6));
        cli_answer_finish(answer);
    }
    if (answer->status == 404 && call->missing_is_ok)
        return CLI_OK;
    if (answer->status < 200 || answer->status >= 300)
        return report(server, answer);
    return CLI_OK;
}

void cli_answer_finish(struct cli_answer *answer)
{
    free(answer->text);
    free(answer->warnings);
    answer->text = answer->warnings = NULL;
}

cJSON *cli_answer_object(const struct cli_answer *answer)
{
    cJSON *object = answer->text ? cJSON_Parse(answer->text) : NULL;
    if (cJSON_IsObject(object))
        return object;
    cJSON_Delete(object);
    cli_fail(CLI_SERVER, "The server's answer is not a JSON object: %.100s",
        answer->text ? answer->text : "");
    return NULL;
}
