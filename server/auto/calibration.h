/* What was measured of a scene on a device: the store's scenes/<id>/calibration-<device>.json. */
#pragma once
#include "protocol/result.h"
#include "server/auto/choice.h"
#include "server/store/scene_store.h"

#define CALIBRATION_TABLES 16 /* views of one scene that are remembered */

/* Two hashes of a request. `setup`: of what error and cost depend on: view, shape of the picture,
 * lights, ground, output; not the method, the size or the tones. `cost`: the same without the
 * camera, the time, and where the lights are and how bright, so that it stays while a camera or a
 * light moves, but not when there are more or larger lights. */
void calibration_setup(
    const struct pen_request *request, uint8_t setup[PEN_ID_BYTES], uint8_t cost[PEN_ID_BYTES]);

/* The table of table->setup; with `any`, when there is none, the newest one that has table->cost,
 * as borrowed. False: nothing is known, or it was measured by another build or on another device;
 * setup and cost are as they were. */
bool calibration_load(struct scene_store *store, const uint8_t scene[PEN_ID_BYTES],
    const struct pen_device_info *device, bool any, struct auto_table *table);
/* Adds or replaces the table of its view; the oldest leaves when there are too many. One thread at
 * a time. False when the store cannot be written. */
bool calibration_save(struct scene_store *store, const uint8_t scene[PEN_ID_BYTES],
    const struct pen_device_info *device, const struct auto_table *table);
