#include "renderer/technique.h"

/* The visibility target starts at 1, which is the whole method. */
static bool record(struct technique_run *run, struct pen_error *error)
{
    (void)run, (void)error;
    return true;
}

const struct technique technique_none = {
    .info = {.name = "none",
        .title = "No shadows",
        .summary = "Every receiver sees the whole light; the baseline of cost and of images.",
        .citation = "-",
        .artefacts = "No shadows at all.",
        .candidates = PEN_CANDIDATES(""),
        .cost_class = PEN_COST_CHEAP,
        .textured = false},
    .record = record,
};
