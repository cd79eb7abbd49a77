/* The method called "auto": which method and settings to take, from what was measured. No I/O and
 * no clock: a table of measurements and a wish give a choice. */
#pragma once
#include "protocol/request.h"
#include "protocol/technique_info.h"

#define AUTO_NAME "auto"
#define AUTO_MAX_ROWS 24
#define AUTO_KEY_BYTES 64

/* What a request for "auto" asks. Neither: max_rmse 0.02. */
struct auto_wish {
    float max_rmse;  /* of the mean visibility against `raytraced`; 0: not asked */
    float budget_ms; /* from taking the request off the queue to its encoded image; 0: not asked */
};

/* The catalogue with "auto" at its end. Call before the first thread. */
const struct pen_catalogue *auto_catalogue(const struct pen_catalogue *catalogue);

/* The candidates of all methods that are worth measuring: those that can do coloured lights if there
 * are any, and would not keep a software renderer busy for minutes. A key names a method and its
 * settings, "pcss search_taps=32 filter_taps=64"; everything else is at its default. Returns how
 * many there are. */
uint32_t auto_candidates(const struct pen_catalogue *catalogue, bool textured, bool software,
    char keys[AUTO_MAX_ROWS][AUTO_KEY_BYTES]);
/* Puts the method and its settings into the request. False: it is the key of no candidate. */
bool auto_apply(
    const char *key, const struct pen_catalogue *catalogue, struct pen_request *request);

/* What was measured of one candidate. */
struct auto_row {
    char key[AUTO_KEY_BYTES];
    double rmse;
    double fixed_ms;  /* shadow inputs, and whatever does not grow with the picture */
    double screen_ms; /* what grows with the pixels, at the table's number of them */
};
struct auto_table {
    uint8_t setup[PEN_ID_BYTES]; /* view and lights; see calibration.h */
    uint8_t cost[PEN_ID_BYTES];  /* the same without the view */
    bool borrowed;               /* taken for a view other than its own */
    uint32_t pixels;             /* at which the times were taken */
    uint32_t count;
    struct auto_row rows[AUTO_MAX_ROWS];
};

struct auto_pick {
    const struct auto_row *row;
    double predicted_ms;
    bool met;      /* false: nothing meets the wish, this is the nearest */
    char why[256]; /* one sentence */
};

/* Milliseconds that a row is expected to take for a picture of so many pixels. Fewer pixels than
 * measured are credited with half of what they should save. */
double auto_predict(const struct auto_table *table, const struct auto_row *row, uint64_t pixels);

/* What renders took by the side of what was expected, as factors. */
#define AUTO_OBSERVATIONS 40
struct auto_observed {
    uint32_t count; /* ever; the last AUTO_OBSERVATIONS are kept */
    float ratios[AUTO_OBSERVATIONS];
};
void auto_observe(struct auto_observed *observed, double expected_ms, double ms);
/* The factor that 19 of 20 renders of a row (`own`) stay below. Fewer than eight can only make an
 * expectation worse; as long as there are no more, what was seen of all rows counts too, once there
 * are twenty: in full when the machine has become slower than it was when it was measured, by half
 * when it has become faster. */
double auto_correction(const struct auto_observed *own, const struct auto_observed *all);

/* What is taken:
 *   max_rmse    the cheapest row that stays below it with a quarter to spare
 *   budget_ms   the most accurate row whose expected time leaves a fifth of the budget free (three
 *               eighths of it when the table is that of another view)
 *   both        the cheapest that does both
 * Nothing does: the most accurate row within the budget, else the fastest; without a budget the
 * most accurate one. False when the table is empty. */
bool auto_choose(const struct auto_table *table, const struct auto_wish *wish, uint64_t pixels,
    struct auto_pick *pick);
