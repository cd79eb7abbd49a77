/* What each address does. A call is one exchange of the public or the admin listener, from its
 * header to the last byte of its answer. */
#pragma once
#include "protocol/routes.h"
#include "server/auto/history.h"
#include "server/service.h"

extern const struct http_callbacks routes_callbacks, routes_admin_callbacks;

/* Addresses that are not in the contract's table. */
enum route_extra { ROUTE_HOME = PEN_ROUTES, ROUTE_DOCS, ROUTE_NONE };

struct call {
    struct service *service;
    struct http_exchange *exchange;
    uint32_t route;          /* enum pen_route_id or route_extra */
    const char *route_label; /* the pattern, for metrics */
    uint8_t id[PEN_ID_BYTES];
    char name[PEN_TECHNIQUE_NAME_BYTES];
    char trace_id[33], trace_flags[3]; /* "" without a traceparent */
    uint64_t client;                   /* whose share a render uses */
    /* Bodies: */
    char *text; /* JSON, not NUL-terminated */
    size_t text_bytes, text_capacity;
    struct upload *upload;
    bool counts_as_upload;
    struct import_task task;
    /* Renders: */
    struct pen_request request;
    struct waiter waiter;
    bool holds_share, wants_record, is_cached;
    struct pen_compare *compare;
    struct call *next_waiting;     /* for a calibration */
    char choice[256];              /* why this method was taken */
    struct auto_expected expected; /* of it */
    bool choice_met, is_deferred;
    /* For the log: */
    const char *technique;
    double queue_ms, render_ms;
    enum pen_code code; /* PEN_OK: nothing went wrong */
    char error[128];
};

/* One file per subject; each is called when the whole request is there. */
void routes_home(struct call *call);
void routes_docs(struct call *call);
void routes_openapi(struct call *call);
void routes_info(struct call *call);
void routes_techniques(struct call *call);
void routes_technique(struct call *call);
void routes_stats(struct call *call);
void routes_list(struct call *call);
void routes_describe(struct call *call);
void routes_delete(struct call *call);
bool routes_begin_upload(struct call *call); /* at the header: false when it has been answered */
void routes_import(struct call *call);
void routes_render(struct call *call);
void routes_result(struct call *call);
void routes_compare(struct call *call);
/* Takes a method for a request that asks for "auto", and goes on with routes_serve; at once, or
 * when the scene has been measured. */
void routes_auto(struct call *call);
/* A complete render request: from the cache or from a worker. */
void routes_serve(struct call *call);

/* Everything the call's request refers to must be in the store. */
bool routes_check_store(struct call *call, struct pen_error *error);

/* Answers. */
void routes_fail(struct call *call, const struct pen_error *error);
void routes_json(struct call *call, uint32_t status, char *text); /* takes the text */
/* Answers 304 when If-None-Match names the tag; true when it has. Adds the ETag either way. */
bool routes_not_modified(struct call *call, const char *tag);

/* A query string split and percent-decoded in place. */
#define ROUTES_MAX_PAIRS 256
struct pen_query_pair;
bool routes_split_query(
    char *query, struct pen_query_pair *pairs, uint32_t *count, struct pen_error *error);
