/* What the tests of textured lights share: images, T5 and the comparison of two renderings. */
#pragma once
#include "tests/accuracy/harness.h"

/* Loads `count` pictures of w x h RGBA8 (top row first, linear) as one emission image; `id` is
 * made from `number`. */
void textured_image(uint32_t number, uint32_t w, uint32_t h, uint32_t count, const uint8_t *rgba,
    uint8_t id[PEN_ID_BYTES]);

/* A rect light above the half-plane scene whose axis `axis` (0: x, 1: y) points along `sign` times
 * the world's +x. */
const char *textured_light(int axis, int sign);

/* T5: the half of the light on the side of world +x is red, the other green; the reverse when
 * `red_is_right` is false. Root mean square error of the red and the green channel where
 * 0.02 < V < 0.98, the larger of the two; `worst` may be NULL. Also checks blue = 0. */
double textured_t5(
    const struct shot *shot, const struct planar_case *t, bool red_is_right, double *worst);

/* T5 by `method` (settings, ended by '&') over the half-plane scene `id` of that case, along both
 * axes of the light and both ways: at most `most`, and red and green each half of the light. */
void textured_check_t5(
    const uint8_t id[PEN_ID_BYTES], const char *method, const struct planar_case *t, double most);

/* Root mean square difference of the coloured visibility of two shots, over all pixels. */
double textured_difference(const struct shot *a, const struct shot *b, double *worst);
