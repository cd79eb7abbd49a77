#include "server/routes/routes.h"
#include "protocol/memory.h"
#include "protocol/fnv.h"
#include "protocol/json_request.h"
#include "server/base/clock.h"
#include "server/base/log.h"
#include "server/http/status.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/random.h>

struct handler {
    void (*end)(struct call *call);
};

static const struct handler handlers[ROUTE_NONE] = {
    [PEN_ROUTE_SERVICE] = {routes_info},
    [PEN_ROUTE_OPENAPI] = {routes_openapi},
    [PEN_ROUTE_TECHNIQUES] = {routes_techniques},
    [PEN_ROUTE_TECHNIQUE] = {routes_technique},
    [PEN_ROUTE_SCENES] = {routes_list},
    [PEN_ROUTE_SCENE_POST] = {routes_import},
    [PEN_ROUTE_SCENE] = {routes_describe},
    [PEN_ROUTE_SCENE_PUT] = {routes_import},
    [PEN_ROUTE_SCENE_DELETE] = {routes_delete},
    [PEN_ROUTE_RENDER] = {routes_render},
    [PEN_ROUTE_RENDER_POST] = {routes_render},
    [PEN_ROUTE_COMPARE] = {routes_compare},
    [PEN_ROUTE_IMAGES] = {routes_list},
    [PEN_ROUTE_IMAGE_POST] = {routes_import},
    [PEN_ROUTE_IMAGE] = {routes_describe},
    [PEN_ROUTE_IMAGE_PUT] = {routes_import},
    [PEN_ROUTE_IMAGE_DELETE] = {routes_delete},
    [PEN_ROUTE_STATS] = {routes_stats},
    [ROUTE_HOME] = {routes_home},
    [ROUTE_DOCS] = {routes_docs},
    [PEN_ROUTE_RESULT] = {routes_result},
};

/* ---- answers ---- */

/* Headers that every answer has. */
static void add_common(struct call *call)
{
    struct http_exchange *x = call->exchange;
    const char *origin = call->service->config->cors_origin;
    http_add_header(x, "X-Request-Id", "%s", x->request_id);
    http_add_header(x, "X-Content-Type-Options", "nosniff");
    if (*call->trace_id) {
        uint8_t span[8];
        if (getrandom(span, sizeof span, 0) != sizeof span)
            abort();
        http_add_header(x, "traceparent", "00-%s-%02x%02x%02x%02x%02x%02x%02x%02x-%s",
            call->trace_id, span[0], span[1], span[2], span[3], span[4], span[5], span[6], span[7],
            call->trace_flags);
    }
    if (*origin) {
        http_add_header(x, "Access-Control-Allow-Origin", "%s", origin);
        http_add_header(x, "Access-Control-Expose-Headers",
            "ETag, Server-Timing, Location, Retry-After, X-Request-Id, Content-Location, "
            "X-Penumbra-Choice, X-Penumbra-Warning");
    }
}

void routes_fail(struct call *call, const struct pen_error *error)
{
    struct http_exchange *x = call->exchange;
    struct http_status told = http_status_of(error->code);
    call->code = (enum pen_code)error->code;
    snprintf(call->error, sizeof call->error, "%.*s", (int)sizeof call->error - 1, error->message);
    if (error->code == PEN_UNAVAILABLE || error->code == PEN_TOO_MANY)
        http_add_header(x, "Retry-After", "%u", error->retry_after_s ? error->retry_after_s : 1);
    if (error->code == PEN_UNAUTHORIZED)
        http_add_header(x, "WWW-Authenticate", "Bearer");
    http_add_header(x, "Cache-Control", "no-store");
    http_answer(
        x, told.status, "application/problem+json", http_text(http_problem(error, x->request_id)));
}

void routes_json(struct call *call, uint32_t status, char *text)
{
    http_answer(call->exchange, status, "application/json", http_text(text));
}

bool routes_not_modified(struct call *call, const char *tag)
{
    const char *wanted = http_header(call->exchange, "If-None-Match");
    char quoted[PEN_ID_HEX + 3];
    snprintf(quoted, sizeof quoted, "\"%s\"", tag);
    http_add_header(call->exchange, "ETag", "%s", quoted);
    /* The list form and weak tags need no parser: our tags cannot be part of another's. */
    if (!wanted || (strcmp(wanted, "*") && !strstr(wanted, quoted)))
        return false;
    http_answer(call->exchange, 304, NULL, http_static(NULL, 0));
    return true;
}

/* ---- the query ---- */

static int hex_digit(char c)
{
    return c >= '0' && c <= '9'   ? c - '0'
           : c >= 'a' && c <= 'f' ? c - 'a' + 10
           : c >= 'A' && c <= 'F' ? c - 'A' + 10
                                  : -1;
}

static bool decode(char *text)
{
    char *to = text;
    for (const char *from = text; *from; from++) {
        if (*from != '%') {
            *to++ = *from == '+' ? ' ' : *from;
            continue;
        }
        int high = hex_digit(from[1]), low = high < 0 ? -1 : hex_digit(from[2]);
        if (low < 0 || (high == 0 && low == 0))
            return false;
        *to++ = (char)(high * 16 + low);
        from += 2;
    }
    *to = 0;
    return true;
}

bool routes_split_query(
    char *query, struct pen_query_pair *pairs, uint32_t *count, struct pen_error *error)
{
    *count = 0;
    for (char *at = query, *next; at && *at; at = next) {
        next = strchr(at, '&');
        if (next)
            *next++ = 0;
        if (!*at)
            continue;
        char *value = strchr(at, '=');
        if (value)
            *value++ = 0;
        if (*count == ROUTES_MAX_PAIRS)
            return pen_fail(error, PEN_MALFORMED, "", "The query has too many keys.");
        if (!decode(at) || (value && !decode(value)))
            return pen_fail(error, PEN_MALFORMED, "", "The query has an invalid percent-encoding.");
        pairs[(*count)++] = (struct pen_query_pair){at, value};
    }
    return true;
}

/* ---- the header ---- */

/* Finds the route; false with an error, and the Allow header when only the method is wrong. */
static bool find_route(struct call *call, struct pen_error *error)
{
    static const struct {
        const char *path;
        uint32_t route;
    } pages[] = {{"/", ROUTE_HOME}, {"/docs", ROUTE_DOCS}};
    struct http_exchange *x = call->exchange;
    struct pen_route_match match;
    char allow[64] = "";
    bool get = !strcmp(x->method, "GET") || !strcmp(x->method, "HEAD");
    call->route = ROUTE_NONE;
    call->route_label = "other";
    for (size_t i = 0; i < sizeof pages / sizeof *pages; i++)
        if (!strcmp(x->path, pages[i].path)) {
            call->route = get ? pages[i].route : ROUTE_NONE;
            call->route_label = pages[i].path;
            strcpy(allow, "GET, HEAD");
        }
    if (!*allow) {
        if (pen_route_find(x->method, x->path, &match)) {
            call->route = match.route->id;
            call->route_label = match.route->pattern;
            memcpy(call->name, match.name, sizeof call->name);
            if (*match.id)
                pen_id_from_hex(match.id, call->id);
        } else if (match.methods) {
            call->route_label = pen_routes[__builtin_ctz(match.methods)].pattern;
            pen_route_allow(match.methods, allow, sizeof allow);
        }
    }
    if (call->route != ROUTE_NONE)
        return true;
    if (!*allow)
        return pen_fail(error, PEN_NOT_FOUND, "", "There is nothing at this address.");
    if (!strcmp(x->method, "OPTIONS") && *call->service->config->cors_origin) {
        http_add_header(x, "Access-Control-Allow-Methods", "%s", allow);
        http_add_header(x, "Access-Control-Allow-Headers",
            "Authorization, Content-Type, If-None-Match, Prefer, traceparent");
        http_add_header(x, "Access-Control-Max-Age", "600");
        http_answer(x, 204, NULL, http_static(NULL, 0));
        return true;
    }
    http_add_header(x, "Allow", "%s", allow);
    return pen_fail(error, PEN_METHOD_NOT_ALLOWED, "", "This address takes %s.", allow);
}

/* 00-<32 hex>-<16 hex>-<2 hex>, as W3C Trace Context says; anything else is ignored. */
static void read_trace(struct call *call)
{
    const char *parent = http_header(call->exchange, "traceparent");
    if (!parent || strlen(parent) != 55 || strncmp(parent, "00-", 3) || parent[35] != '-' ||
        parent[52] != '-' || strspn(parent + 3, "0123456789abcdef") != 32 ||
        strspn(parent + 36, "0123456789abcdef") != 16 ||
        strspn(parent + 53, "0123456789abcdef") != 2 || strspn(parent + 3, "0") == 32)
        return;
    memcpy(call->trace_id, parent + 3, 32);
    memcpy(call->trace_flags, parent + 53, 2);
}

static bool authorise(struct call *call, struct pen_error *error)
{
    const struct service *s = call->service;
    bool open =
        call->route == ROUTE_HOME || call->route == ROUTE_DOCS || call->route == PEN_ROUTE_OPENAPI;
    const char *address = call->exchange->client; /* of clients without a token */
    call->client = pen_fnv(PEN_FNV_START, address, strlen(address)) | 1ull << 63;
    if (!s->auth)
        return true;
    uint32_t token = auth_check(s->auth, http_header(call->exchange, "Authorization"));
    if (token)
        call->client = token;
    return token || open ||
           pen_fail(error, PEN_UNAUTHORIZED, "", "This address needs a bearer token.");
}

/* Refuses a body that the route does not take, before it is sent. */
static bool check_body(struct call *call, struct pen_error *error)
{
    struct http_exchange *x = call->exchange;
    uint8_t takes =
        call->route < PEN_ROUTES ? pen_routes[call->route].takes : (uint8_t)PEN_BODY_NONE;
    if (takes != PEN_BODY_REQUEST && takes != PEN_BODY_COMPARE)
        return true;
    const char *type = http_header(x, "Content-Type");
    size_t length = type ? strcspn(type, "; ") : 0;
    bool json = type && ((length == 16 && !strncasecmp(type, "application/json", 16)) ||
                            (length > 17 && !strncasecmp(type, "application/", 12) &&
                                !strncasecmp(type + length - 5, "+json", 5)));
    if (type && !json)
        return pen_fail(error, PEN_UNKNOWN_TYPE, "", "A render request is application/json.");
    if (x->content_length != HTTP_UNKNOWN_LENGTH && x->content_length > PEN_MAX_JSON_BYTES)
        return pen_fail(
            error, PEN_TOO_BIG, "", "A render request has at most %d bytes.", PEN_MAX_JSON_BYTES);
    return true;
}

static void begin(struct http_exchange *x, const struct pen_error *framing)
{
    struct call *call = pen_alloc_zero(1, sizeof *call);
    struct pen_error error = *framing;
    x->user = call;
    call->service = http_listener_context(x->listener);
    call->exchange = x;
    call->route = ROUTE_NONE;
    call->route_label = "other";
    read_trace(call);
    add_common(call);
    if (error.code != PEN_OK || !find_route(call, &error) || x->answered ||
        !authorise(call, &error) || !check_body(call, &error)) {
        if (!x->answered)
            routes_fail(call, &error);
        return;
    }
    uint8_t takes =
        call->route < PEN_ROUTES ? pen_routes[call->route].takes : (uint8_t)PEN_BODY_NONE;
    if (takes == PEN_BODY_SCENE_UPLOAD || takes == PEN_BODY_IMAGE_UPLOAD)
        routes_begin_upload(call);
}

/* ---- the body ---- */

static void body(struct http_exchange *x, const void *data, size_t bytes)
{
    struct call *call = x->user;
    struct pen_error error = {0};
    __atomic_add_fetch(&call->service->bytes_received, bytes, __ATOMIC_RELAXED);
    if (call->upload) {
        if (!upload_add(call->upload, data, bytes, &error))
            routes_fail(call, &error);
        return;
    }
    if (call->text_bytes + bytes > PEN_MAX_JSON_BYTES) {
        pen_fail(
            &error, PEN_TOO_BIG, "", "A render request has at most %d bytes.", PEN_MAX_JSON_BYTES);
        routes_fail(call, &error);
        return;
    }
    call->text = pen_grow(call->text, &call->text_capacity, call->text_bytes + bytes, 1);
    memcpy(call->text + call->text_bytes, data, bytes);
    call->text_bytes += bytes;
}

static void end(struct http_exchange *x)
{
    struct call *call = x->user;
    handlers[call->route].end(call);
}

static void completed(struct http_exchange *x)
{
    struct call *call = x->user;
    struct service *s = call->service;
    double ms = clock_ms(clock_now_ns() - x->header_ns);
    if (call->holds_share)
        scheduler_release(s->scheduler, call->client);
    if (call->counts_as_upload)
        __atomic_sub_fetch(&s->uploads, 1, __ATOMIC_ACQ_REL);
    upload_destroy(call->upload);
    __atomic_add_fetch(&s->bytes_sent, x->body.size, __ATOMIC_RELAXED);
    metrics_request(s->metrics, call->route_label, x->status, ms);
    struct log_request line = {.listener = "public",
        .request_id = x->request_id,
        .trace_id = *call->trace_id ? call->trace_id : NULL,
        .client = x->client,
        .method = x->method,
        .target = x->path,
        .status = x->status,
        .bytes = x->body.size,
        .ms = ms,
        .technique = call->technique,
        .queue_ms = call->queue_ms,
        .render_ms = call->render_ms,
        .cached = call->is_cached,
        .code = call->code,
        .error = *call->error ? call->error : NULL,
        .aborted = x->aborted};
    log_write_request(&line);
    free(call->compare);
    free(call->text);
    free(call);
}

const struct http_callbacks routes_callbacks = {begin, body, end, completed};
