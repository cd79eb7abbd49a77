// One work group sums one line of `source` and writes it as a column: run twice, that is a
// summed-area table. Integer sums wrap, so their order does not matter.
#include "sat_scan.def"
layout(local_size_x = 256) in;
layout(binding = UNIT_SOURCE) uniform usampler2D source;
layout(FORMAT, binding = IMAGE_SUMS) writeonly uniform uimage2D target;
shared uvec4 partial[256];

void main()
{
    int line = int(gl_WorkGroupID.x), self = int(gl_LocalInvocationID.x);
    int length = textureSize(source, 0).x, share = (length + 255) / 256;
    int first = min(self * share, length), end = min(first + share, length);
    uvec4 sum = uvec4(0u);
    for (int i = first; i < end; i++)
        sum += texelFetch(source, ivec2(i, line), 0);
    partial[self] = sum;
    barrier();
    // Hillis and Steele 1986, on the sums of all invocations' shares.
    for (int reach = 1; reach < 256; reach *= 2) {
        uvec4 before = self >= reach ? partial[self - reach] : uvec4(0u);
        barrier();
        partial[self] += before;
        barrier();
    }
    sum = self > 0 ? partial[self - 1] : uvec4(0u);
    for (int i = first; i < end; i++) {
        sum += texelFetch(source, ivec2(i, line), 0);
        imageStore(target, ivec2(line, i) + OFFSET, sum);
    }
}
