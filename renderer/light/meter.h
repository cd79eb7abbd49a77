/* An incident-light meter: how bright what the lights reach is, before any shadow. */
#pragma once
#include "renderer/light/light.h"

/* Radiance, W m^-2 sr^-1, of a white diffuse surface where the lights reach the content best: a
 * third above what four fifths of all that they reach stay below. Independent of the camera and, in
 * an animation, of the time, so that exposure is steady along a sequence: the brightest moment
 * counts. `scenes_own`: the lights are those of the scene, which may move. 1 without any light that
 * reaches anything. */
float light_meter(
    const struct light *lights, uint32_t count, bool scenes_own, const struct scene *scene);
/* Fills in the request's exposure and the sky's level, where it leaves them open. */
void light_choose_exposure(struct pen_request *request, const struct light *lights, uint32_t count,
    bool scenes_own, const struct scene *scene);
