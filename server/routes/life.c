/* The life of a request: the table of its steps, and what all calls have in common. */
#include "protocol/fnv.h"
#include "protocol/memory.h"
#include "server/base/clock.h"
#include "server/base/log.h"
#include "server/access/guard.h"
#include "server/routes/routes.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static enum step_end guard(struct call *call, struct pen_error *error);
static enum step_end find(struct call *call, struct pen_error *error);
static enum step_end authorise(struct call *call, struct pen_error *error);
static enum step_end resolve(struct call *call, struct pen_error *error);
static enum step_end admit(struct call *call, struct pen_error *error);
static enum step_end receive(struct call *call, struct pen_error *error);
static enum step_end handle(struct call *call, struct pen_error *error);
static enum step_end settle(struct call *call, struct pen_error *error);
static enum step_end record(struct call *call, struct pen_error *error);
static enum step_end bury(struct call *call, struct pen_error *error);

static const struct step life[] = {
    /* The header is there, and properly framed. */
    {"guard", guard},         /* whom it is meant for, and which page sends it */
    {"find", find},           /* the address; answers OPTIONS of other origins */
    {"authorise", authorise}, /* the token, and whose share it uses */
    {"resolve", resolve},     /* an id that is only its first digits */
    {"admit", admit},         /* the body: of the right type and size, an upload finds a place */
    {"receive", receive},     /* waits for the last byte of the body */
    /* The whole request is there. */
    {"handle", handle}, /* the row's handler answers, or waits in steps of its own (render.c,
                           compare.c, store.c) for a worker or an importer */
};
static const struct step after_life[] = {
    /* The answer is out, or the client is lost. */
    {"settle", settle}, /* gives back shares, places and memory */
    {"record", record}, /* metrics and the log */
    {"bury", bury},
};

static bool (*const handlers[PEN_ROUTES])(struct call *call, struct pen_error *error) = {
#define ENDPOINT(id, ...) [PEN_ROUTE_##id] = route_##id,
#include "protocol/endpoints.def"
};

static enum step_end guard(struct call *call, struct pen_error *error)
{
    struct http_exchange *x = call->exchange;
    const struct config *config = call->service->config;
    const struct guard own = {config->allow_host, call->service->public_name, config->cors_origin};
    const struct guard_request request = {.method = x->method,
        .host = call->host,
        .origin = http_header(x, "Origin"),
        .site = http_header(x, "Sec-Fetch-Site"),
        .authorization = http_header(x, "Authorization"),
        .scheme = call->scheme};
    return guard_host(&own, request.host, error) && guard_page(&own, &request, error) ? STEP_NEXT
                                                                                      : STEP_FAILED;
}

static enum step_end find(struct call *call, struct pen_error *error)
{
    struct http_exchange *x = call->exchange;
    char allow[64];
    if (pen_route_find(x->method, x->path, &call->address)) {
        call->label = call->address.route->pattern;
        return STEP_NEXT;
    }
    if (!strcmp(x->path, "*")) { /* OPTIONS of the whole service (RFC 9110, 9.3.7) */
        http_add_header(x, "Allow", "GET, HEAD, POST, PUT, PATCH, DELETE, OPTIONS");
        http_answer(x, 204, NULL, http_static(NULL, 0));
        return STEP_OVER;
    }
    if (!call->address.methods) {
        pen_fail(error, PEN_NOT_FOUND, "", "There is nothing at this address.");
        return STEP_FAILED;
    }
    call->label = pen_routes[__builtin_ctzll(call->address.methods)].pattern;
    pen_route_allow(call->address.methods, allow, sizeof allow);
    if (!strcmp(x->method, "OPTIONS") && *call->service->config->cors_origin) {
        http_add_header(x, "Access-Control-Allow-Methods", "%s", allow);
        http_add_header(x, "Access-Control-Allow-Headers",
            "Authorization, Content-Type, Idempotency-Key, If-None-Match, If-Range, Last-Event-ID, "
            "Prefer, Range, traceparent");
        http_add_header(x, "Access-Control-Max-Age", "600");
        http_answer(x, 204, NULL, http_static(NULL, 0));
        return STEP_OVER;
    }
    http_add_header(x, "Allow", "%s", allow);
    pen_fail(error, PEN_METHOD_NOT_ALLOWED, "", "This address takes %s.", allow);
    return STEP_FAILED;
}

/* What a call needs, by its row. */
static enum auth_scope scope_of(const struct pen_route *route)
{
    bool reads = !strcmp(route->method, "GET");
    if (pen_upload_types((enum pen_body)route->takes) || route->id == PEN_ROUTE_scene_patch ||
        route->id == PEN_ROUTE_scene_delete || route->id == PEN_ROUTE_image_delete)
        return AUTH_UPLOAD;
    return reads && route->gives != PEN_BODY_RENDERED ? AUTH_READ : AUTH_RENDER;
}

static bool enter(struct call *call, struct pen_error *error)
{
    struct auth *auth = call->service->auth;
    enum auth_scope scope = scope_of(call->address.route);
    if (!(call->grant.scopes & (scope | AUTH_ADMIN)))
        return pen_fail(error, PEN_FORBIDDEN, "",
            "This token does not allow this: it lacks \"%s\".", auth_scope_name(scope));
    if (!auth_count(auth, &call->grant, clock_now_ns(), error))
        return false;
    call->renders = scope == AUTH_RENDER && auth_enter(auth, &call->grant, error);
    return call->renders || scope != AUTH_RENDER;
}

static enum step_end authorise(struct call *call, struct pen_error *error)
{
    const struct service *s = call->service;
    const char *from = call->exchange->client;
    call->client = pen_fnv(PEN_FNV_START, from, strlen(from)) | 1ull << 63; /* without a token */
    if (!s->auth)
        return STEP_NEXT;
    bool known = auth_check(s->auth, http_header(call->exchange, "Authorization"), &call->grant);
    if (known)
        call->client = call->grant.owner;
    if (call->address.route->flags & PEN_ROUTE_OPEN)
        return STEP_NEXT;
    if (known)
        return enter(call, error) ? STEP_NEXT : STEP_FAILED;
    pen_fail(error, PEN_UNAUTHORIZED, "", "This address needs a bearer token.");
    return STEP_FAILED;
}

static enum step_end resolve(struct call *call, struct pen_error *error)
{
    if (!routes_resolve(call, error))
        return STEP_FAILED;
    if (!strncmp(call->label, "/v1/scenes/{id}", 15))
        pen_id_to_hex(call->address.id, call->note.scene);
    return STEP_NEXT;
}

static uint64_t stored_bytes(void *context, const uint8_t id[PEN_ID_BYTES])
{
    struct service *s = context;
    struct store_entry entry;
    uint64_t sum = 0;
    for (enum store_kind kind = 0; kind < STORE_KINDS; kind++)
        sum += scene_store_find(s->store, kind, id, &entry) ? store_entry_size(&entry) : 0;
    return sum;
}

/* The token's part of the store, as far as the length of what comes is known. */
static bool check_part(struct call *call, struct pen_error *error)
{
    struct service *s = call->service;
    uint64_t most = call->grant.stored_bytes, length = call->exchange->content_length;
    if (!most)
        return true;
    uint64_t sum = owners_sum(s->owners, call->grant.owner, stored_bytes, s);
    return (sum < most && (length == HTTP_UNKNOWN_LENGTH || length <= most - sum)) ||
           pen_fail(error, PEN_FULL, "", "This token may store %llu bytes, and has %llu.",
               (unsigned long long)most, (unsigned long long)sum);
}

static enum step_end admit(struct call *call, struct pen_error *error)
{
    enum pen_body takes = (enum pen_body)call->address.route->takes;
    if (pen_upload_types(takes) && !check_part(call, error))
        return STEP_FAILED;
    call->body.client = call->client;
    return body_open(&call->body, call->service, takes, call->exchange, error) ? STEP_NEXT
                                                                               : STEP_FAILED;
}

static enum step_end receive(struct call *call, struct pen_error *error)
{
    (void)call, (void)error;
    return STEP_OVER; /* end() resumes it */
}

static enum step_end handle(struct call *call, struct pen_error *error)
{
    return handlers[call->address.route->id](call, error) ? STEP_OVER : STEP_FAILED;
}

static enum step_end settle(struct call *call, struct pen_error *error)
{
    (void)error;
    if (call->end_work)
        call->end_work(call, call->work);
    free(call->work);
    if (call->renders)
        auth_leave(call->service->auth, &call->grant);
    body_finish(&call->body, call->service);
    return STEP_NEXT;
}

static enum step_end record(struct call *call, struct pen_error *error)
{
    (void)error;
    struct service *s = call->service;
    const struct http_exchange *x = call->exchange;
    const struct call_note *note = &call->note;
    double ms = clock_ms(clock_now_ns() - x->header_ns);
    __atomic_add_fetch(&s->bytes_sent, x->body.size, __ATOMIC_RELAXED);
    metrics_request(s->metrics, call->label, x->status, ms);
    struct log_request line = {.listener = "public",
        .request_id = x->request_id,
        .trace_id = *call->trace.id ? call->trace.id : NULL,
        .client = x->client,
        .method = x->method,
        .target = x->path,
        .status = x->status,
        .bytes = x->body.size,
        .ms = ms,
        .scene = *note->scene ? note->scene : NULL,
        .token = *call->grant.name ? call->grant.name : NULL,
        .technique = note->technique,
        .queue_ms = note->queue_ms,
        .render_ms = note->render_ms,
        .cached = note->cached,
        .code = note->code,
        .error = *note->error ? note->error : NULL,
        .aborted = x->aborted};
    log_write_request(&line);
    return STEP_NEXT;
}

static enum step_end bury(struct call *call, struct pen_error *error)
{
    (void)error;
    free(call);
    return STEP_OVER;
}

/* ---- the listener's callbacks ---- */

/* Who asks, by what name and under what path: as a proxy says that is trusted, or as it came. */
static void find_client(struct call *call)
{
    struct http_exchange *x = call->exchange;
    const struct service *s = call->service;
    const char *proxies = s->config->trusted_proxy;
    strcpy(call->prefix, s->public_prefix);
    call->host = http_host(x);
    call->scheme = *s->config->tls_cert ? "https" : proxy_scheme(s->config->public_url);
    if (!proxy_is_listed(proxies, x->client))
        return;
    const char *prefix = http_header(x, "X-Forwarded-Prefix");
    const char *host = http_header(x, "X-Forwarded-Host");
    char said[PROXY_PREFIX_BYTES];
    if (prefix && proxy_prefix(prefix, said))
        strcpy(call->prefix, said);
    const char *scheme = proxy_scheme(http_header(x, "X-Forwarded-Proto"));
    if (host)
        call->host = host;
    if (scheme)
        call->scheme = scheme;
    proxy_client(proxies, http_header(x, "X-Forwarded-For"), x->client);
}

/* A proxy may pass the path on as it is. */
static void strip_prefix(struct call *call)
{
    const char *prefix = call->prefix;
    char *path = call->exchange->path;
    size_t bytes = strlen(prefix);
    if (bytes && !strncmp(path, prefix, bytes) && path[bytes] == '/')
        memmove(path, path + bytes, strlen(path + bytes) + 1);
}

/* Headers that every answer has. */
static void add_common(struct call *call)
{
    struct http_exchange *x = call->exchange;
    const char *origin = call->service->config->cors_origin;
    http_add_header(x, "X-Request-Id", "%s", x->request_id);
    http_add_header(x, "X-Content-Type-Options", "nosniff");
    if (*call->trace.id) {
        char text[HTTP_TRACE_BYTES];
        http_trace_answer(&call->trace, text);
        http_add_header(x, "traceparent", "%s", text);
    }
    if (*origin) {
        http_add_header(x, "Access-Control-Allow-Origin", "%s", origin);
        http_add_header(x, "Access-Control-Expose-Headers",
            "ETag, Server-Timing, Location, Retry-After, X-Request-Id, Content-Location, "
            "X-Penumbra-Choice, X-Penumbra-History, X-Penumbra-Warning, Accept-Ranges, "
            "Content-Range, Preference-Applied");
    }
}

static void begin(struct http_exchange *x, const struct pen_error *fault)
{
    struct call *call = pen_alloc_zero(1, sizeof *call);
    x->user = call;
    call->service = http_listener_context(x->listener);
    call->exchange = x;
    call->label = "other";
    call->next = life;
    http_trace_read(&call->trace, http_header(x, "traceparent"));
    find_client(call);
    strip_prefix(call);
    add_common(call);
    call_resume(call, fault);
}

static void body(struct http_exchange *x, const void *data, size_t bytes)
{
    struct call *call = x->user;
    struct pen_error error = {0};
    __atomic_add_fetch(&call->service->bytes_received, bytes, __ATOMIC_RELAXED);
    if (!body_add(&call->body, data, bytes, &error))
        call_resume(call, &error);
}

static void end(struct http_exchange *x)
{
    struct call *call = x->user;
    struct pen_error error = {0};
    body_end(&call->body, &error);
    call_resume(call, &error);
}

static void completed(struct http_exchange *x)
{
    call_run(x->user, after_life, NULL);
}

const struct http_callbacks routes_callbacks = {begin, body, end, completed};
