// The Gaussian that stands for the light, cut where the light ends, so that nothing reaches beyond
// the true penumbra. Seen from the side a rectangle is a uniform segment and a disk a half ellipse:
// in half extents, the cut Gaussian's own deviation is `falloff` and what is left of it has the
// variance of that profile (rectangle: 0.29 of 0.33, for a Gaussian and not a box).
const float light_gauss_falloff = light_shape == SHAPE_DISK ? 0.68 : 1.0;
const float light_gauss_deviation = light_shape == SHAPE_DISK ? 0.5 : 0.54;
