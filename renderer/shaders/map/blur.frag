// One direction of a separable binomial-like kernel; weights are the host's.
#include "blur.def"
layout(binding = UNIT_SOURCE) uniform sampler2D source;
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
