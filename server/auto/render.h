/* Renders whose method is left open: measures a scene when nothing is known of it. */
#pragma once
#include "server/auto/history.h"
#include "server/queue/scheduler.h"
#include "server/store/scene_store.h"

struct auto_parts {
    struct scheduler *scheduler;
    struct scene_store *store;
    const struct pen_catalogue *catalogue; /* with "auto" in it */
};
struct auto_runs;
struct auto_runs *auto_runs_create(const struct auto_parts *parts);
void auto_runs_destroy(struct auto_runs *runs); /* none may be under way; NULL is fine */

/* One render that asks for "auto". Its owner keeps it until the method is chosen. */
struct auto_render {
    struct pen_request *request; /* gets the method that is taken */
    uint64_t deadline_ns;
    /* After auto_runs_measure: called once, from any thread. An error: nothing was chosen. */
    void (*chosen)(struct auto_render *render, const struct pen_error *error);
    struct auto_render *next;
    /* The choice: */
    char why[256]; /* "": none yet */
    bool met;      /* false: nothing meets what was asked */
    struct auto_expected expected;
};

/* Takes a method from what was measured. False: nothing is known, or, with the error filled,
 * nothing could be measured. */
bool auto_runs_recall(struct auto_runs *runs, const struct pen_device_info *device,
    struct auto_render *render, struct pen_error *error);
/* Measures the scene, or joins a run that does, and then takes a method. False, with the error, when
 * too many are being measured; `chosen` is then not called. */
bool auto_runs_measure(struct auto_runs *runs, const struct pen_device_info *device,
    struct auto_render *render, struct pen_error *error);
/* A chosen render took `ms`: the next choice knows. Any thread. */
void auto_runs_observe(struct auto_runs *runs, const struct auto_render *render, double ms);
