/* How long the renders that "auto" chose took lately, by the side of what was expected of them. */
#pragma once
#include "server/auto/choice.h"

/* What a chosen render is expected to take, and whose experience its time adds to. */
struct auto_expected {
    uint8_t
        row[PEN_ID_BYTES]; /* method and settings, kind of view and lights, size of the picture */
    uint8_t all[PEN_ID_BYTES]; /* the same for every method and setting */
    double ms;                 /* as measured, before any correction */
};

struct auto_history;
struct auto_history *auto_history_create(void);
void auto_history_destroy(struct auto_history *history); /* NULL is fine */

/* Fills row and all. `cost`: see calibration_setup; `key`: of the candidate. */
void auto_history_name(const uint8_t cost[PEN_ID_BYTES], const char *key, uint32_t width,
    uint32_t height, struct auto_expected *expected);
/* A render took `ms`. Any thread. */
void auto_history_add(
    struct auto_history *history, const struct auto_expected *expected, double ms);
/* What to multiply an expected time with: auto_correction of what is remembered. Any thread. */
double auto_history_factor(struct auto_history *history, const struct auto_expected *expected);
