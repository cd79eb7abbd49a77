/* The metrics' properties and closed forms. */
#include "renderer/metrics/metrics.h"
#include "tests/unit/check.h"

#define WIDTH 48
#define HEIGHT 37
#define PIXELS (WIDTH * HEIGHT)

static float noise[PIXELS][4], other[PIXELS][4];

static struct pen_metrics_image image_of(float (*pixels)[4])
{
    return (struct pen_metrics_image){pixels[0], WIDTH, HEIGHT, 4};
}

static void fill(float (*pixels)[4], float r, float g, float b)
{
    for (int i = 0; i < PIXELS; i++) {
        pixels[i][0] = r;
        pixels[i][1] = g;
        pixels[i][2] = b;
        pixels[i][3] = 1;
    }
}

static void fill_noise(float (*pixels)[4], uint32_t seed)
{
    for (int i = 0; i < PIXELS; i++)
        for (int c = 0; c < 4; c++) {
            seed = seed * 1664525u + 1013904223u;
            pixels[i][c] = (float)(seed >> 8) / (1 << 24);
        }
}

static double ssim(float (*a)[4], float (*b)[4], float *map)
{
    struct pen_metrics_image x = image_of(a), y = image_of(b);
    struct pen_metrics_similarity s = {NAN, NAN};
    CHECK(pen_metrics_ssim(&x, &y, map, &s, NULL));
    return s.mean;
}

static double flip(float (*a)[4], float (*b)[4])
{
    static float map[PIXELS];
    struct pen_metrics_image x = image_of(a), y = image_of(b);
    double mean = NAN, sum = 0;
    CHECK(pen_metrics_flip(&x, &y, 0, map, &mean, NULL));
    for (int i = 0; i < PIXELS; i++) {
        CHECK(map[i] >= 0 && map[i] <= 1);
        sum += (double)map[i];
    }
    CHECK_NEAR(sum / PIXELS, mean, 1e-6);
    return mean;
}

static void test_rmse(void)
{
    struct pen_metrics_image a = image_of(noise), b = image_of(other);
    struct pen_metrics_visibility v;
    double rmse;
    fill_noise(noise, 1);
    for (int i = 0; i < PIXELS; i++)
        for (int c = 0; c < 4; c++)
            other[i][c] = noise[i][c] + (c < 2 ? 0.25f : c == 2 ? -0.5f : 7);
    CHECK(pen_metrics_rmse(&a, &b, 2, &rmse, NULL));
    CHECK_NEAR(rmse, 0.25, 1e-7);
    CHECK(pen_metrics_rmse(&a, &b, 3, &rmse, NULL));
    CHECK_NEAR(rmse, sqrt((2 * 0.0625 + 0.25) / 3), 1e-7);

    /* Two errors, in the penumbra only one of them; the borders 0.02 and 0.98 are outside. */
    fill(noise, 0, 0, 0);
    fill(other, 0, 0, 0);
    other[0][0] = 0.5f; /* the reference */
    noise[0][0] = 0.6f;
    other[1][0] = 1;
    noise[1][0] = 0.7f;
    other[2][0] = 0.98f;
    other[3][0] = 0.02f;
    noise[2][0] = 0.98f;
    noise[3][0] = 0.02f;
    other[4][0] = noise[4][0] = 0.021f;
    other[5][0] = noise[5][0] = 0.979f;
    CHECK(pen_metrics_visibility(&a, &b, &v, NULL));
    CHECK(v.penumbra_pixels == 3 + (0.98f < 0.98) + (0.02f > 0.02));
    CHECK_NEAR(v.rmse, sqrt(0.1 / PIXELS), 1e-7);
    CHECK_NEAR(v.penumbra_rmse, 0.1 / sqrt((double)v.penumbra_pixels), 1e-7);
    CHECK_NEAR(v.mean_error, -0.2 / PIXELS, 1e-8);
    CHECK_NEAR(v.largest, 0.3, 1e-7);
    CHECK(pen_metrics_visibility(&b, &b, &v, NULL) && v.rmse == 0 && v.penumbra_rmse == 0);
}

static void test_ssim(void)
{
    static float map[PIXELS];
    fill_noise(noise, 2);
    CHECK_NEAR(ssim(noise, noise, map), 1, 1e-12);
    for (int i = 0; i < PIXELS; i++)
        CHECK_NEAR((double)map[i], 1, 1e-6);
    fill_noise(other, 3);
    double mean = ssim(noise, other, map);
    CHECK_NEAR(mean, ssim(other, noise, NULL), 1e-12);
    CHECK(mean > -0.2 && mean < 0.2); /* unrelated noise */
    double sum = 0;                   /* the mean leaves out five pixels along the border */
    for (int y = 5; y < HEIGHT - 5; y++)
        for (int x = 5; x < WIDTH - 5; x++)
            sum += (double)map[y * WIDTH + x];
    CHECK_NEAR(sum / ((WIDTH - 10) * (HEIGHT - 10)), mean, 1e-6);

    /* Constants: only the luminance term remains. */
    for (int k = 0; k < 4; k++) {
        double a = 0.3 * k, b = 1 - 0.2 * k;
        fill(noise, (float)a, (float)a, (float)a);
        fill(other, (float)b, (float)b, (float)b);
        CHECK_NEAR(ssim(noise, other, map), (2 * a * b + 1e-4) / (a * a + b * b + 1e-4), 1e-6);
        CHECK_NEAR((double)map[0], (2 * a * b + 1e-4) / (a * a + b * b + 1e-4), 1e-6);
    }
    /* Luma weights: green counts five times as much as blue. */
    fill(noise, 0, 0, 0);
    fill(other, 0, 0, 1);
    CHECK_NEAR(ssim(noise, other, NULL), 1e-4 / (0.114 * 0.114 + 1e-4), 1e-6);

    /* No window fits: the mean is that of all pixels. */
    fill_noise(noise, 4);
    fill_noise(other, 5);
    struct pen_metrics_image x = {noise[0], 7, 9, 4}, y = {other[0], 7, 9, 4};
    struct pen_metrics_similarity s;
    CHECK(pen_metrics_ssim(&x, &y, map, &s, NULL));
    for (int i = (int)(sum = 0); i < 63; i++)
        sum += (double)map[i];
    CHECK_NEAR(s.mean, sum / 63, 1e-6);
}

static void test_flip(void)
{
    fill_noise(noise, 6);
    CHECK(flip(noise, noise) == 0);
    fill_noise(other, 7);
    double far = flip(noise, other);
    CHECK(far > 0.1 && far <= 1);
    CHECK_NEAR(far, flip(other, noise), 1e-12);

    /* Flat colours have no features: green against blue is the largest error there is. */
    fill(noise, 0, 1, 0);
    fill(other, 0, 0, 1);
    CHECK_NEAR(flip(noise, other), 1, 1e-9);
    /* Greys: HyAB is the difference of L*, and that of black and white is 100. */
    fill(noise, 0, 0, 0);
    double last = 0;
    for (int k = 1; k <= 10; k++) {
        fill(other, 0.1f * (float)k, 0.1f * (float)k, 0.1f * (float)k);
        double error = flip(noise, other);
        CHECK(error > last);
        last = error;
    }
    CHECK(last > 0.95 && last < 1); /* beyond the knee */
    /* The same in closed form, from tabulated CIELAB values (D65) of sRGB's green (87.735, -86.183,
     * 83.179) and blue (32.297, 79.188, -107.860), a and b times L / 100, and of the grey 0.5
     * (53.389): largest error 203.30^0.7 = 41.276, its knee at 16.510. */
    double most = pow(55.438 + hypot(75.613 + 25.575, 72.977 + 34.836), 0.7), knee = 0.4 * most;
    CHECK_NEAR(most, 41.276, 1e-3);
    CHECK_NEAR(last, 0.95 + 0.05 * (pow(100, 0.7) - knee) / (most - knee), 1e-4);
    fill(other, 0.5f, 0.5f, 0.5f);
    CHECK_NEAR(flip(noise, other), 0.95 * pow(53.389, 0.7) / knee, 1e-4);

    /* More noise, more error. */
    last = 0;
    for (int k = 1; k <= 8; k++) {
        fill_noise(other, 8);
        fill(noise, 0.5f, 0.5f, 0.5f);
        for (int i = 0; i < PIXELS; i++)
            for (int c = 0; c < 3; c++)
                other[i][c] = 0.5f + (other[i][c] - 0.5f) * 0.1f * (float)k;
        double error = flip(noise, other);
        CHECK(error > last);
        last = error;
    }
    /* A missing dot is worse than the same energy spread out: features count. */
    fill(noise, 0.5f, 0.5f, 0.5f);
    fill(other, 0.5f, 0.5f, 0.5f);
    for (int c = 0; c < 3; c++)
        other[PIXELS / 2][c] = 1;
    double dot = flip(noise, other);
    CHECK(dot > 0 && dot < 0.2);
}

static void test_refusals(void)
{
    struct pen_metrics_image a = image_of(noise), b = a;
    double value;
    struct pen_metrics_similarity similarity;
    struct pen_error error = {0};
    b.width--;
    CHECK(!pen_metrics_rmse(&a, &b, 3, &value, &error) && error.code == PEN_INVALID);
    CHECK(!pen_metrics_ssim(&a, &b, NULL, &similarity, NULL));
    CHECK(!pen_metrics_flip(&a, &b, 0, NULL, &value, NULL));
    b = a;
    b.stride = 2;
    CHECK(!pen_metrics_flip(&a, &b, 0, NULL, &value, NULL));
    CHECK(!pen_metrics_flip(&a, &a, 2000, NULL, &value, NULL));
    CHECK(!pen_metrics_flip(&a, &a, NAN, NULL, &value, NULL) || value == 0);
    a.width = b.width = 0;
    b.stride = 4;
    CHECK(!pen_metrics_rmse(&a, &b, 3, &value, NULL));
}

int main(void)
{
    test_rmse();
    test_ssim();
    test_flip();
    test_refusals();
    CHECK_DONE();
}
