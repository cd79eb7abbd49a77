// Where the ground is seen its depth becomes that of its top (TOP in geometry.vert).
layout(binding = UNIT_ALBEDO) uniform sampler2D g_albedo;

void main()
{
    if (texelFetch(g_albedo, ivec2(gl_FragCoord.xy), 0).a != 0.0)
        discard;
}
