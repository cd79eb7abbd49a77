// The camera of the frame; mirrors struct view_block in frame.c.
layout(std140, binding = 0) uniform ViewBlock {
    mat4 world_to_clip;
    mat4 clip_to_world;
    vec4 eye;          // xyz, m; w: pixels per unit of tangent, H / (2 tan(fov_y / 2))
    vec4 forward;      // unit; w: near plane, so that a pixel's view distance is forward.w / depth
    vec4 viewport;     // width, height, 1 / width, 1 / height
    vec4 ambient;      // radiance
    vec4 background;   // radiance
    vec4 ground;       // centre x, height, centre z, half side
    vec4 ground_albedo;
    vec4 display;      // exposure factor, tone map, number of the jittered frame, 1 / frames
} view;

vec2 pixel_to_ndc(ivec2 pixel)
{
    vec2 uv = (vec2(pixel) + 0.5) * view.viewport.zw;
    return vec2(2.0 * uv.x - 1.0, 1.0 - 2.0 * uv.y);
}

vec3 unproject(mat4 matrix, vec2 ndc, float depth)
{
    vec4 p = matrix * vec4(ndc, depth, 1.0);
    return p.xyz / p.w;
}
