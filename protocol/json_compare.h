/* Comparisons: several methods against a reference, on one view of one scene. */
#pragma once
#include "protocol/json_result.h"

#define PEN_COMPARE_METHODS 32
#define PEN_COMPARE_PIXELS (4u << 20) /* px: what is compared is held in float */

struct pen_compare {
    uint32_t count; /* methods */
    /* The reference, then the methods: they differ in nothing else. */
    struct pen_request requests[1 + PEN_COMPARE_METHODS];
    char warning[192]; /* "" or why the reference is another */
};

/* Reads the body of a comparison: a render request without "technique" and "output", and
 *   "techniques"  "all" (the default: every method with its defaults, but the reference's), or 1 to
 *                 32 methods, each a name or {"name", "params"}
 *   "reference"   a method; default: "raytraced" with 1024 samples, or "multisample" with 1024
 *                 where the build has no "raytraced", and then a warning
 * Errors as pen_request_from_json. Methods in `excluded` (by name, may be NULL)
 * cannot be compared. */
bool pen_compare_from_json(const char *text, size_t bytes, const struct pen_catalogue *catalogue,
    const char *excluded, struct pen_compare *compare, struct pen_error *error);

/* One row of the answer. */
struct pen_compared {
    const struct pen_result *result; /* error.code set: the method could not be rendered */
    const char *image, *difference, *ssim_map, *flip_map; /* addresses, or NULL */
};

/* The answer; rows[0] is the reference. */
char *pen_compare_json(const struct pen_compare *compare, const struct pen_compared *rows,
    const char *request_id, double total_ms, const struct pen_catalogue *catalogue);
/* One row of it alone, of the request with this number, 0 the reference. */
char *pen_compared_json(const struct pen_compare *compare, const struct pen_compared *row,
    uint32_t number, const struct pen_catalogue *catalogue);
