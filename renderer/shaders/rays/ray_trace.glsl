// All that a shader needs to shoot shadow rays.
#include "rays.def"
#include "ray_hash.glsl"
#ifdef ALPHA
#include "ray_alpha.glsl"
#endif
#include "ray_bvh.glsl"
#include "ray_job.glsl"
#include "ray_light.glsl"
