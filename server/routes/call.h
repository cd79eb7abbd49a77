/* A call: one exchange of the public listener, from its header to the last byte of its answer. It
 * lives in steps (life.c); each of its parts belongs to the module that is named there. */
#pragma once
#include "protocol/routes.h"
#include "server/http/trace.h"
#include "server/routes/body.h"
#include "server/routes/context.h"

struct call;

/* What a step leaves behind. */
enum step_end {
    STEP_NEXT,   /* the next one can follow */
    STEP_OVER,   /* answered, or waiting in other hands: the call must not be touched any more */
    STEP_FAILED, /* the error becomes the answer */
};
struct step {
    const char *name;
    enum step_end (*run)(struct call *call, struct pen_error *error);
};

/* For the log. */
struct call_note {
    char scene[PEN_ID_HEX + 1]; /* that was asked about, or uploaded; or "" */
    const char *technique;      /* of renders */
    double queue_ms, render_ms;
    bool cached;
    enum pen_code code; /* PEN_OK: nothing went wrong */
    char error[128];
};

struct call {
    struct service *service;
    struct http_exchange *exchange;
    struct pen_route_match address; /* address.route NULL: there is no such call */
    const char *label;              /* its pattern, for metrics */
    uint64_t client;                /* whose share a render uses */
    struct auth_grant grant;        /* owner 0: no token was asked for, or none given */
    bool renders;                   /* counts as one of the token's renders */
    struct http_trace trace;
    struct call_body body;
    const struct step *next; /* the step that follows */
    void *work;              /* the handler's own, given to `end_work` when the answer is out */
    void (*end_work)(struct call *call, void *work);
    struct call_note note;
    char prefix[PROXY_PREFIX_BYTES]; /* that links begin with, "" for none */
    const char *host;                /* that the client asked, or NULL */
    const char *scheme;              /* and how: "http", "https", NULL: not known */
};

/* Whose the jobs are that it asks for and about: the same after a restart. */
uint64_t call_owner(const struct call *call);
/* Whether it may see and end what belongs to this owner. */
bool call_may_touch(const struct call *call, uint64_t owner);
/* Runs steps from `first` on until one ends the row. False: one has failed, with its error. */
bool call_run(struct call *call, const struct step *first, struct pen_error *error);
/* Goes on with the step behind the one that waited, or answers with `failure` (NULL, PEN_OK: there
 * is none). Any thread; the call must not be touched afterwards. */
void call_resume(struct call *call, const struct pen_error *failure);
/* Memory for the handler, all zero, freed after `end` (which may be NULL). */
void *call_work(struct call *call, size_t bytes, void (*end)(struct call *call, void *work));

/* Answers. */
/* Answers with a JSON document, which it takes. Returns true. */
bool call_json(struct call *call, uint32_t status, char *text);
/* The problem document of an error, which is noted for the log; the caller frees it. */
char *call_problem(struct call *call, const struct pen_error *error);
/* Answers 304 when If-None-Match names the tag; true when it has. Adds the ETag either way. */
bool call_not_modified(struct call *call, const char *tag);
/* Whether If-None-Match names the tag, rather than any. */
bool call_knows(const struct call *call, const char *tag);
