// Keeps the rasteriser busy until the gate is open.
#include "release.def"
layout(location = 0) out vec4 value;
void main()
{
    uint looks = 0u;
    while (looks < gate[1] && atomicAdd(gate[0], 0u) == 0u)
        looks++;
    value = vec4(looks);
}
