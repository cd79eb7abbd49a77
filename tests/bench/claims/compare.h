/* Errors of one picture against another, as JSON, and the pictures themselves. */
#pragma once
#include "protocol/json_writer.h"
#include "renderer/renderer.h"
#include "tests/bench/claims/plan.h"

struct picture {
    uint32_t width, height;
    float *visibility; /* RGBA per pixel; NULL: could not be rendered */
    uint8_t *beauty;   /* RGBA per pixel, display-encoded */
    double seconds;    /* the first image took, shaders and all */
    struct pen_result result;
};

/* Adds variant `test` against variant `reference` to the open array; nothing when
 * either is missing. */
void compare_write(struct pen_json *json, const struct plan_group *group,
    const struct picture *pictures, uint32_t test, uint32_t reference, bool flip);

/* FOLDER/<group>--<variant>.png of every variant, and <group>--<variant>--difference.png of its
 * visibility against the reference: red where too light, blue where too dark, full at 0.25. */
void compare_pictures(
    const char *folder, const struct plan_group *group, const struct picture *pictures);
