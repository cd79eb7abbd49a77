/* Depth maps of the casters. */
#pragma once
#include "renderer/passes/map/shadow_cache.h"

/* Depth map seen from the light's centre, size x size, D32F in textures[0]: 0 at near_z, 1 at far_z
 * and where nothing is. Kept between requests. */
const struct shadow_input *pass_depth_map(
    struct technique_run *run, uint32_t size, struct pen_error *error);

/* The same without backdrops (light_find_backdrops): for methods that compare depths, where what
 * cannot cast only costs time and bias. Methods that filter depths want pass_depth_map. */
const struct shadow_input *pass_caster_map(
    struct technique_run *run, uint32_t size, struct pen_error *error);

/* Draws the casters seen from `sample` through `rect` into a D32F framebuffer (cleared here). */
bool pass_draw_casters(struct technique_run *run, GLuint framebuffer, uint32_t size,
    const float sample[2], const float rect[4], bool backdrops, struct pen_error *error);

/* Depth peeling, one layer: what of the casters lies behind the 2D depth texture `layer_before` of
 * the same size, far sides included, seen from the light's centre. */
bool pass_draw_casters_behind(struct technique_run *run, GLuint framebuffer, uint32_t size,
    GLuint layer_before, struct pen_error *error);
