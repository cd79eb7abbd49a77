#include "tests/unit/documents_catalogue.h"

const char *const fake_modes[] = {"plain", "quadtree", "stratified", NULL};

#define ROW(field, ...) PARAM(struct fake_params, field, __VA_ARGS__)
static const struct pen_param pcss_rows[] = {
    ROW(search_taps, .def = 16, .min = 1, .max = 64, .specialise = 1, .help = "Search samples."),
    ROW(offset, .def = -2, .min = -8, .max = 8, .unit = "texel", .help = "A signed offset."),
    ROW(bias, .def = 0.02, .min = 0, .max = 0.1, .exclusive_min = 1, .unit = "m",
        .help = "A positive length."),
    ROW(tint, .def_v = {1, 0.5, 0.25}, .min = 0, .max = 1, .help = "A vector."),
    ROW(mode, .def = 1, .choices = fake_modes, .help = "An enumeration."),
    ROW(rotate, .def = 1, .help = "A flag."),
};

struct hard_params {
    float width; /* the same name as a key of the request */
};
static const struct pen_param hard_rows[] = {
    PARAM(struct hard_params, width, .def = 0.5, .min = 0, .max = 1, .help = "A factor."),
};

static const struct pen_technique_info none = {.name = "none",
    .title = "No shadows",
    .summary = "Everything is lit.",
    .citation = "-",
    .artefacts = "No shadow.",
    .textured = true};
static const struct pen_technique_info hard = {.name = "hard",
    .title = "Hard shadows",
    .summary = "One sample.",
    .citation = "Williams, Casting curved shadows on curved surfaces, SIGGRAPH, 1978",
    .artefacts = "Aliasing.",
    .struct_size = sizeof(struct hard_params),
    .params = PEN_TABLE(hard_rows)};
static const struct pen_technique_info pcss = {.name = "pcss",
    .title = "Percentage-closer soft shadows",
    .summary = "Blocker search, then a filter as wide as the penumbra.",
    .citation = "Fernando, Percentage-closer soft shadows, SIGGRAPH sketches, 2005",
    .artefacts = "Blockers are averaged into one.",
    .cost_class = PEN_COST_MEDIUM,
    .struct_size = sizeof(struct fake_params),
    .params = PEN_TABLE(pcss_rows)};

static const struct pen_technique_info *const items[] = {&none, &hard, &pcss};
const struct pen_catalogue fake_catalogue = {items, 3};
