// One direction of a separable binomial-like kernel; weights are the host's.
layout(binding = 7) uniform sampler2D source;
layout(std140, binding = 3) uniform BlurBlock {
    vec4 step;       // xy: one texel along the direction, in texture coordinates; z: radius
    vec4 weights[4]; // of distance 0 to 15
} blur;
layout(location = 0) out vec4 result;

void main()
{
    vec2 uv = gl_FragCoord.xy / vec2(textureSize(source, 0));
    vec4 sum = texture(source, uv) * blur.weights[0].x;
    for (int i = 1; i <= int(blur.step.z); i++)
        sum += (texture(source, uv + float(i) * blur.step.xy) +
                   texture(source, uv - float(i) * blur.step.xy)) *
            blur.weights[i >> 2][i & 3];
    result = sum;
}
