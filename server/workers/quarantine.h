/* Scenes that ended workers. */
#pragma once
#include "protocol/limits.h"
#include <stdbool.h>
#include <stdint.h>

struct quarantine;
struct quarantine *quarantine_create(uint64_t seconds);
void quarantine_destroy(struct quarantine *quarantine);
/* The scene ended a worker. True when this is the second time and it is refused from now on. */
bool quarantine_blame(struct quarantine *quarantine, const uint8_t scene[PEN_ID_BYTES]);
uint32_t quarantine_remaining_s(struct quarantine *quarantine, const uint8_t scene[PEN_ID_BYTES]);
uint32_t quarantine_count(struct quarantine *quarantine);
