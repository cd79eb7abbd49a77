/* The built-in emission patterns (pen_pattern_names), drawn on the CPU. */
#pragma once
#include <stdint.h>

#define EMISSION_FRAMES_PER_SECOND 24

/* Frames after which the pattern repeats; 1: it does not move. */
uint32_t emission_pattern_frames(uint32_t pattern);

/* side x side texels of linear RGB, top row first, as seen from the scene. */
void emission_pattern_draw(uint32_t pattern, uint32_t frame, uint32_t side, float (*rgb)[3]);
