/* Rays, on the device or the host. */
#pragma once
#include "renderer/passes/rays/rays.h"

/* Without Embree there is no RAYS_ON_CPU, and RAYS_AUTO is RAYS_ON_GPU. */
enum ray_backend { RAYS_AUTO, RAYS_ON_GPU, RAYS_ON_CPU };

/* Traces the rays of run->light where `backend`, an enum ray_backend, says, and counts them and their
 * receivers into run->result. Fills targets, or vis itself: *settled. */
bool pass_rays(struct technique_run *run, uint32_t backend, const struct ray_job *job,
    struct ray_targets *targets, bool *settled, struct pen_error *error);
