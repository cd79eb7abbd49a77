/* Renders whose method is left open: measures a scene when nothing is known of it. */
#pragma once

struct auto_runs;
struct auto_runs *auto_runs_create(void);
/* A render that "auto" chose took `ms`: the next choice knows. Any thread. */
struct call;
void auto_runs_observe(struct auto_runs *runs, const struct call *call, double ms);
void auto_runs_destroy(struct auto_runs *runs); /* none may be under way; NULL is fine */
