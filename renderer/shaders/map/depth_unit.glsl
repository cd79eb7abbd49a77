// Linear depth from 0 at near_z to 1 at far_z, in which all moments are taken.
#include "light.glsl"

float depth_unit(float d) // from hardware depth
{
    return light.parallel != 0
               ? d
               : d * light.near_z / (light.far_z - d * (light.far_z - light.near_z));
}

float depth_unit_of_z(float z) // from m
{
    return (z - light.near_z) / (light.far_z - light.near_z);
}

float depth_unit_to_z(float u)
{
    return light.near_z + u * (light.far_z - light.near_z);
}

// The receiver's plane as seen in a window of the map: what a statistic of that window is compared
// with.
struct PlaneInWindow {
    float mean;            // not above the mean of the plane, clamped to far_z, over the window
    float lowest, highest; // bounds of the plane over the window
    bool clamped;          // the plane reaches beyond far_z there
};

// `offset`: centre of the window minus the receiver's own position; `extent`: its half size; m on
// the map plane. All results are lowered by `bias`, in unit depth.
PlaneInWindow plane_in_window(ReceiverPlane plane, vec2 offset, vec2 extent, float bias)
{
    // The normal comes from a half-float buffer, so the slope has an error of its own.
    float reach = 1.05 * dot(abs(plane.gradient), extent);
    float center = plane.depth + dot(plane.gradient, offset);
    // What clamping to the far plane takes from the mean: exact when the slope follows one axis,
    // else an upper bound. Unit depth is a convex function of hardware depth, so the mean of the
    // one is not below the other taken at the mean.
    float over = clamp(center + reach - 1.0, 0.0, 2.0 * reach);
    float mean = min(center - over * over / max(4.0 * reach, 1e-20), 1.0);
    PlaneInWindow r;
    r.clamped = over > 0.0;
    r.mean = depth_unit(max(mean, 0.0)) - bias;
    r.lowest = depth_unit(clamp(center - reach, 0.0, 1.0)) - bias;
    r.highest = depth_unit(clamp(center + reach, 0.0, 1.0)) - bias;
    return r;
}
