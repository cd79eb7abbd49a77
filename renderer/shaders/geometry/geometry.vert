// All geometry passes. FULL: every attribute; ALPHA: what an alpha test needs; GROUND: the receiver
// under the bounds, made of four vertices without any buffer.
#include "view.glsl"
#include "attributes.def"

layout(location = LOCATION_TO_CLIP) uniform mat4 to_clip; // world to clip space of the target

layout(location = ATTRIBUTE_POSITION) in vec3 position;
#if defined(FULL) || defined(ALPHA)
layout(location = ATTRIBUTE_UV) in vec4 uv;
layout(location = ATTRIBUTE_COLOR) in vec4 color;
layout(location = ATTRIBUTE_MATERIAL) in float material;
out vec4 v_uv;
out vec4 v_color;
#ifndef ALPHA
flat out uint v_material; // of those that are bound
#endif
#endif
#ifdef FULL
layout(location = ATTRIBUTE_NORMAL) in vec4 normal;
layout(location = ATTRIBUTE_TANGENT) in vec4 tangent;
out vec3 v_position; // relative to the eye: keeps derivatives exact far from the origin
out vec3 v_normal;
out vec4 v_tangent;
#endif
layout(location = ATTRIBUTE_ROW0) in vec4 row0;
layout(location = ATTRIBUTE_ROW1) in vec4 row1;
layout(location = ATTRIBUTE_ROW2) in vec4 row2;

void main()
{
#ifdef GROUND
    vec2 corner = vec2((gl_VertexID & 1) * 2 - 1, (gl_VertexID >> 1) * 2 - 1);
#ifdef TOP
    corner *= 0.99; // and nowhere where none is drawn
    float height = view.ground_albedo.w;
#else
    float height = view.ground.y;
#endif
    vec3 world = vec3(
        view.ground.x + corner.x * view.ground.w, height, view.ground.z - corner.y * view.ground.w);
    v_uv = vec4(0.0);
    v_color = vec4(1.0);
    v_material = 0u;
    v_normal = vec3(0.0, 1.0, 0.0);
    v_tangent = vec4(0.0);
#else
    vec4 p = vec4(position, 1.0);
    vec3 world = vec3(dot(row0, p), dot(row1, p), dot(row2, p));
#if defined(FULL) || defined(ALPHA)
    v_uv = uv;
    v_color = color;
#ifndef ALPHA
    v_material = uint(material);
#endif
#endif
#ifdef FULL
    // Normals go with the cofactor matrix, which also serves singular and mirroring matrices. Unit
    // length before they are interpolated, as if the vertices had been transformed in the file.
    v_normal = vec3(dot(cross(row1.xyz, row2.xyz), normal.xyz),
        dot(cross(row2.xyz, row0.xyz), normal.xyz), dot(cross(row0.xyz, row1.xyz), normal.xyz));
    float side = dot(row0.xyz, cross(row1.xyz, row2.xyz)) < 0.0 ? -1.0 : 1.0;
    v_normal *= side * inversesqrt(max(dot(v_normal, v_normal), 1e-36));
    // What mirrors turns the cross product round that gives the bitangent.
    vec3 along =
        vec3(dot(row0.xyz, tangent.xyz), dot(row1.xyz, tangent.xyz), dot(row2.xyz, tangent.xyz));
    v_tangent = vec4(along * inversesqrt(max(dot(along, along), 1e-36)), tangent.w * side);
#endif
#endif
#ifdef FULL
    v_position = world - view.eye.xyz;
#endif
    gl_Position = to_clip * vec4(world, 1.0);
}
