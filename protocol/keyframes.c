#include "protocol/keyframes.h"

static double slope(const double *places, const double *values, uint32_t count, uint32_t key)
{
    uint32_t before = key ? key - 1 : 0, after = key + 1 < count ? key + 1 : key;
    return (values[after] - values[before]) / (places[after] - places[before]);
}

double pen_keyframes_at(
    const double *places, const double *values, uint32_t count, bool cubic, double x)
{
    uint32_t key = 0;
    if (count < 2 || x <= places[0])
        return values[0];
    while (key + 1 < count && places[key + 1] <= x)
        key++;
    if (key + 1 == count || x == places[key])
        return values[key];
    double width = places[key + 1] - places[key], t = (x - places[key]) / width;
    double from = values[key], to = values[key + 1];
    if (!cubic)
        return from + t * (to - from);
    double t2 = t * t, t3 = t2 * t;
    return (2 * t3 - 3 * t2 + 1) * from + (3 * t2 - 2 * t3) * to +
           width * ((t3 - 2 * t2 + t) * slope(places, values, count, key) +
                       (t3 - t2) * slope(places, values, count, key + 1));
}
