/* From glTF's terms to the blob's: what the importer does once, and every pose anew. */
#pragma once
#include "renderer/blob/pscene.h"

/* KHR_texture_transform as uv' = T R S uv, row-major 2x3; the identity when it is not finite. */
void pose_texture_transform(const struct psc_map_rest *map, float transform[6]);

/* Factors into the ranges that shading takes; emission = factor * strength. */
void pose_finish_material(struct psc_material *material, const struct psc_material_rest *rest);

/* Colour, power and cones of a light of to->type. */
void pose_light_power(struct pen_light *to, const struct psc_light_rest *from);

/* Position, target, up and, for area lights, the size from `size` (height and width before scaling).
 * False, and nothing is done, beyond PEN_FAR. */
bool pose_place_light(struct pen_light *to, const double world[12], const float size[2]);

/* Eye, target and up; `along`: from the node to the eye along the axis, and from there to the
 * target, m. False, and nothing is done, beyond PEN_FAR. */
bool pose_place_camera(struct psc_camera *to, const double world[12], const float along[2]);

float pose_fov_y_deg(float radians);
