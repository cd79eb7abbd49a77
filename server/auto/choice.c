#include "server/auto/choice.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define RMSE_MARGIN 1.25 /* another resolution and other pixels than those that were measured */
#define TIME_MARGIN 1.25
#define TIME_MARGIN_BORROWED 1.6 /* another view may show more of the penumbra */
#define FEW_OBSERVATIONS 8
#define MANY_OBSERVATIONS 20
#define DEFAULT_RMSE 0.02f
#define MAX_METHODS 63

static const struct pen_param params[] = {
    PARAM(struct auto_wish, max_rmse, .def = 0, .min = 0, .max = 1,
        .help = "Largest error of the mean visibility against raytraced (root mean square over all "
                "pixels); 0: not asked; when budget_ms is 0 too: 0.02."),
    PARAM(struct auto_wish, budget_ms, .def = 0, .min = 0, .max = 60000, .unit = "ms",
        .help = "Time for rendering and encoding; 0: not asked."),
};

static const struct pen_technique_info info = {.name = AUTO_NAME,
    .title = "Automatic choice",
    .summary = "Takes the cheapest method and settings that meet max_rmse, or the most accurate "
               "that meet budget_ms, from what was measured on this scene and device. The first "
               "request for a view measures, and takes longer.",
    .citation = "",
    .artefacts = "Those of the method that it takes.",
    .cost_class = PEN_COST_MEDIUM,
    .textured = true,
    .struct_size = sizeof(struct auto_wish),
    .params = {params, sizeof params / sizeof *params}};

const struct pen_catalogue *auto_catalogue(const struct pen_catalogue *catalogue)
{
    static const struct pen_technique_info *items[MAX_METHODS + 1];
    static struct pen_catalogue with_auto;
    uint32_t count = catalogue->count < MAX_METHODS ? catalogue->count : MAX_METHODS;
    memcpy(items, catalogue->items, count * sizeof *items);
    items[count] = &info;
    with_auto = (struct pen_catalogue){items, count + 1};
    return &with_auto;
}

uint32_t auto_candidates(const struct pen_catalogue *catalogue, bool textured, bool software,
    char keys[AUTO_MAX_ROWS][AUTO_KEY_BYTES])
{
    uint32_t count = 0;
    for (uint32_t m = 0; m < catalogue->count; m++) {
        const struct pen_technique_info *method = catalogue->items[m];
        if ((textured && !method->textured) || (software && method->candidates_need_gpu))
            continue;
        for (const char *const *at = method->candidates; at && *at && count < AUTO_MAX_ROWS; at++)
            snprintf(keys[count++], AUTO_KEY_BYTES, "%s%s%s", method->name, **at ? " " : "", *at);
    }
    return count;
}

bool auto_apply(const char *key, const struct pen_catalogue *catalogue, struct pen_request *request)
{
    char copy[AUTO_KEY_BYTES], *rest = NULL;
    snprintf(copy, sizeof copy, "%s", key);
    const char *name = strtok_r(copy, " ", &rest);
    const struct pen_technique_info *method = name ? pen_catalogue_find(catalogue, name) : NULL;
    if (!method)
        return false;
    memset(request->technique, 0, sizeof request->technique);
    memset(request->technique_params, 0, sizeof request->technique_params);
    memcpy(request->technique, method->name, strlen(method->name));
    pen_params_default(method->params, request->technique_params);
    for (char *pair; (pair = strtok_r(NULL, " ", &rest));) {
        char *value = strchr(pair, '=');
        if (!value)
            return false;
        *value++ = 0;
        const struct pen_param *row = pen_param_find(method->params, pair);
        if (!row || !pen_param_parse(row, request->technique_params, value, "", NULL))
            return false;
    }
    return true;
}

double auto_predict(const struct auto_table *table, const struct auto_row *row, uint64_t pixels)
{
    double ratio = (double)pixels / (table->pixels ? table->pixels : 1);
    return row->fixed_ms + row->screen_ms * (ratio < 1 ? 0.5 * (1 + ratio) : ratio);
}

void auto_observe(struct auto_observed *observed, double expected_ms, double ms)
{
    if (expected_ms > 0 && ms > 0)
        observed->ratios[observed->count++ % AUTO_OBSERVATIONS] = (float)(ms / expected_ms);
}

static int compare_floats(const void *a, const void *b)
{
    float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

/* What 19 of 20 stay below; 1 when nothing was seen. */
static double high_ratio(const struct auto_observed *observed, uint32_t count)
{
    struct auto_observed sorted = *observed;
    if (!count)
        return 1;
    qsort(sorted.ratios, count, sizeof *sorted.ratios, compare_floats);
    return sorted.ratios[(uint32_t)ceil(0.95 * count) - 1];
}

static uint32_t count_of(const struct auto_observed *observed)
{
    return observed->count < AUTO_OBSERVATIONS ? observed->count : AUTO_OBSERVATIONS;
}

double auto_correction(const struct auto_observed *own, const struct auto_observed *all)
{
    uint32_t own_count = count_of(own), all_count = count_of(all);
    double high = high_ratio(own, own_count), others = high_ratio(all, all_count);
    if (own_count >= FEW_OBSERVATIONS)
        return high;
    if (all_count < MANY_OBSERVATIONS)
        others = 1;
    else if (others < 1)
        others = 0.5 * (1 + others);
    return own_count ? fmax(high, others) : others;
}

static void explain(
    const struct auto_table *table, const struct auto_wish *wish, struct auto_pick *pick)
{
    char asked[96];
    int at = 0;
    if (wish->max_rmse > 0)
        at = snprintf(asked, sizeof asked, "max_rmse %g", wish->max_rmse);
    if (wish->budget_ms > 0)
        snprintf(asked + at, sizeof asked - (size_t)at, "%sbudget_ms %g", at ? " and " : "",
            wish->budget_ms);
    snprintf(pick->why, sizeof pick->why,
        "%s: RMSE %.4f and %.1f ms expected, the %s of what was measured%s %s %s.", pick->row->key,
        pick->row->rmse, pick->predicted_ms,
        pick->met ? (wish->max_rmse > 0 ? "cheapest" : "most accurate") : "nearest",
        table->borrowed ? " from another view" : "", pick->met ? "that meets" : "as nothing meets",
        asked);
}

bool auto_choose(const struct auto_table *table, const struct auto_wish *given, uint64_t pixels,
    struct auto_pick *pick)
{
    struct auto_wish wish = *given;
    if (!(wish.max_rmse > 0) && !(wish.budget_ms > 0))
        wish.max_rmse = DEFAULT_RMSE;
    enum { CHEAPEST_MET, ACCURATE_MET, ACCURATE_IN_TIME, FASTEST, ACCURATE, RULES };
    const struct auto_row *best[RULES] = {0};
    double best_value[RULES], margin = table->borrowed ? TIME_MARGIN_BORROWED : TIME_MARGIN;
    for (uint32_t i = 0; i < table->count; i++) {
        const struct auto_row *row = &table->rows[i];
        double ms = auto_predict(table, row, pixels);
        if (!isfinite(row->rmse) || !isfinite(ms))
            continue;
        bool accurate = !(wish.max_rmse > 0) || row->rmse * RMSE_MARGIN <= wish.max_rmse;
        bool fast = !(wish.budget_ms > 0) || ms * margin <= wish.budget_ms;
        const bool applies[RULES] = {wish.max_rmse > 0 && accurate && fast,
            !(wish.max_rmse > 0) && fast, wish.budget_ms > 0 && fast, wish.budget_ms > 0, true};
        const double value[RULES] = {ms, row->rmse, row->rmse, ms, row->rmse};
        for (int r = 0; r < RULES; r++)
            if (applies[r] && (!best[r] || value[r] < best_value[r])) {
                best[r] = row;
                best_value[r] = value[r];
            }
    }
    int rule = 0;
    while (rule < RULES && !best[rule])
        rule++;
    if (rule == RULES)
        return false;
    pick->row = best[rule];
    pick->predicted_ms = auto_predict(table, pick->row, pixels);
    pick->met = rule <= ACCURATE_MET;
    explain(table, &wish, pick);
    return true;
}
