/* An incident-light meter: how bright what the lights reach is, before any shadow. */
#pragma once
#include "renderer/light/light.h"

/* Fills in the request's exposure and the sky's level, where it leaves them open. `scenes_own`: the
 * lights are those of the scene, which may move. */
void light_choose_exposure(struct pen_request *request, const struct light *lights, uint32_t count,
    bool scenes_own, const struct scene *scene);
