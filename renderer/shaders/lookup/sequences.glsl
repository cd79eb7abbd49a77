// Well-spread points that several patterns are made of.

// The R2 sequence (Roberts 2018) is walked by adding this, modulo 1.
const vec2 R2_STEP = vec2(0.75487767, 0.56984029);

// Point `order` of the Hammersley set of 16.
vec2 hammersley16(int order)
{
    return (vec2(order, bitfieldReverse(order) >> 28 & 15) + 0.5) / 16.0;
}
