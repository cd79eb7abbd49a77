/* What is known of a shadow method without a GPU: the front end validates, documents and lists
 * methods from this alone. */
#pragma once
#include "protocol/param.h"

enum pen_cost_class { PEN_COST_CHEAP, PEN_COST_MEDIUM, PEN_COST_HEAVY, PEN_COST_REFERENCE };

struct pen_technique_info {
    const char *name;      /* JSON name: lower case, words joined by '-' */
    const char *title;     /* "Percentage-closer soft shadows" */
    const char *summary;   /* what it computes, one or two sentences */
    const char *citation;  /* authors, title, venue, year */
    const char *artefacts; /* what is known to go wrong, one or two sentences */
    uint32_t cost_class;   /* enum pen_cost_class */
    bool textured;         /* rgb of its visibility follows the emission texture */
    bool keeps_history;    /* goes on from the frame before of a request's session */
    uint32_t struct_size;  /* bytes of its parameter struct, at most PEN_TECHNIQUE_PARAM_BYTES */
    struct pen_param_table params;
    /* What is worth measuring when the choice of a method is left open: settings as "name=value"
     * pairs, "" for the defaults; ended by NULL. NULL: this method is not taken then. */
    const char *const *candidates;
    bool candidates_need_gpu; /* in software they would take minutes */
};
#define PEN_CANDIDATES(...) ((const char *const[]){__VA_ARGS__, NULL})

struct pen_catalogue {
    const struct pen_technique_info *const *items;
    uint32_t count;
};

const struct pen_technique_info *pen_catalogue_find(
    const struct pen_catalogue *catalogue, const char *name);
