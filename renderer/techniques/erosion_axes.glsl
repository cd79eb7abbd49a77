// Where one unit of the light's half extent along x (xy) and along y (zw) lies on the screen, in
// pixels, when W is 1.
#include "penumbra.glsl"
#include "erosion_window.glsl"

vec4 visibility(Surface s)
{
    mat2 pixels = pixels_per_map(s);
    return clamp(vec4(pixels[0] * window_extent.x, pixels[1] * window_extent.y), -60000.0, 60000.0);
}
