/* What the pre-test says of a receiver, and who needs all samples. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

enum verdict { NO_RECEIVER, UMBRA, LIT, MIXED };

/* Sets full[i] to 1 within `radius` receivers of a mixed verdict or an edge. False: out of memory. */
bool trace_verdicts_spread(
    const uint8_t *verdicts, uint32_t width, uint32_t height, uint32_t radius, uint8_t *full);
