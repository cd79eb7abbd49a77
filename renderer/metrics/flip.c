/* LDR-FLIP: Andersson, Nilsson, Akenine-Moeller, Oskarsson, Astrom & Fairchild, "FLIP: A Difference
 * Evaluator for Alternating Images", 2020. Constants are the paper's. */
#include "renderer/metrics/colour.h"
#include "renderer/metrics/filter.h"
#include <math.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

#define PIXELS_PER_DEGREE 67.0
#define COLOUR_EXPONENT 0.7  /* q_c */
#define COLOUR_KNEE 0.4      /* p_c: this share of the largest colour error ... */
#define KNEE_VALUE 0.95      /* p_t: ... is mapped to this */
#define FEATURE_EXPONENT 0.5 /* q_f */
#define FEATURE_WIDTH 0.082  /* w, degrees */
#define MAX_RADIUS 512

/* The eye's blur per opponent channel: sum of a sqrt(pi / b) exp(-(pi d)^2 / b), d in degrees. */
static const struct {
    double a, b;
} contrast[3][2] = {
    {{1, 0.0047}, {0, 0.04}}, {{1, 0.0053}, {0, 0.04}}, {{34.1, 0.04}, {13.5, 0.025}}};
#define WIDEST 0.04 /* the largest b: all channels' filters reach as far */

struct flip {
    uint32_t width, height;
    size_t pixels;
    double pixels_per_degree;
    struct metrics_colour space;
};

/* One of the two pictures, and what becomes of it. */
struct sight {
    const struct flip *flip;
    const struct pen_metrics_image *image;
    double *seen[3];    /* opponent channels, filtered; then Hunt's Lab */
    double *feature[2]; /* edge and point strength */
    double *scratch[3];
};
#define SIGHT_PLANES 8

static void gaussian(struct metrics_kernel *kernel, double b, double pixels_per_degree)
{
    for (int k = -kernel->radius; k <= kernel->radius; k++) {
        double degrees = k / pixels_per_degree;
        kernel->weights[k] = exp(-M_PI * M_PI * degrees * degrees / b);
    }
}

static double kernel_sum(const struct metrics_kernel *kernel)
{
    double sum = 0;
    for (int k = -kernel->radius; k <= kernel->radius; k++)
        sum += kernel->weights[k];
    return sum;
}

/* Blurs one opponent channel as the eye does. */
static void blur_channel(struct sight *s, double *channel, int number)
{
    const struct flip *f = s->flip;
    double weights[2 * MAX_RADIUS + 1], total = 0;
    struct metrics_kernel kernel = {weights + MAX_RADIUS,
        (int)ceil(3 * sqrt(WIDEST / (2 * M_PI * M_PI)) * f->pixels_per_degree)};
    double *sum = s->scratch[1], *one = s->scratch[2];
    memset(sum, 0, f->pixels * sizeof *sum);
    for (int part = 0; part < 2; part++) {
        double a = contrast[number][part].a, b = contrast[number][part].b;
        double scale = a * sqrt(M_PI / b);
        if (a == 0)
            continue;
        gaussian(&kernel, b, f->pixels_per_degree);
        metrics_filter(
            channel, f->width, f->height, &kernel, &kernel, METRICS_REPEAT, s->scratch[0], one);
        total += scale * kernel_sum(&kernel) * kernel_sum(&kernel);
        for (size_t i = 0; i < f->pixels; i++)
            sum[i] += scale * one[i];
    }
    for (size_t i = 0; i < f->pixels; i++)
        channel[i] = sum[i] / total;
}

/* Scales the positive weights to sum to 1 and the negative ones to -1. */
static void balance(struct metrics_kernel *kernel)
{
    double positive = 0, negative = 0;
    for (int k = -kernel->radius; k <= kernel->radius; k++)
        if (kernel->weights[k] > 0)
            positive += kernel->weights[k];
        else
            negative -= kernel->weights[k];
    for (int k = -kernel->radius; k <= kernel->radius; k++)
        kernel->weights[k] /= kernel->weights[k] > 0 ? positive : negative;
}

/* Strength of edges (first derivatives) or points (second) of the achromatic channel in [0,1]. */
static void detect(struct sight *s, const double *achromatic, bool points, double *strength)
{
    const struct flip *f = s->flip;
    double across[2 * MAX_RADIUS + 1], along[2 * MAX_RADIUS + 1];
    double sigma = 0.5 * FEATURE_WIDTH * f->pixels_per_degree;
    int radius = (int)ceil(3 * sigma);
    struct metrics_kernel derivative = {across + MAX_RADIUS, radius};
    struct metrics_kernel smooth = {along + MAX_RADIUS, radius};
    for (int k = -radius; k <= radius; k++) {
        double g = exp(-k * k / (2 * sigma * sigma));
        smooth.weights[k] = g;
        derivative.weights[k] = points ? (k * k / (sigma * sigma) - 1) * g : -k * g;
    }
    double total = kernel_sum(&smooth);
    for (int k = -radius; k <= radius; k++)
        smooth.weights[k] /= total;
    balance(&derivative);
    metrics_filter(achromatic, f->width, f->height, &derivative, &smooth, METRICS_REPEAT,
        s->scratch[0], s->scratch[1]);
    metrics_filter(achromatic, f->width, f->height, &smooth, &derivative, METRICS_REPEAT,
        s->scratch[0], s->scratch[2]);
    for (size_t i = 0; i < f->pixels; i++)
        strength[i] = hypot(s->scratch[1][i], s->scratch[2][i]);
}

/* Fills seen and feature. */
static void *look_at(void *given)
{
    struct sight *s = given;
    const struct flip *f = s->flip;
    const struct pen_metrics_image *image = s->image;
    double **seen = s->seen, *achromatic = s->feature[1];
    for (size_t i = 0; i < f->pixels; i++) {
        double rgb[3], ycc[3];
        for (int c = 0; c < 3; c++)
            rgb[c] = metrics_decode((double)image->data[i * image->stride + (size_t)c]);
        metrics_opponent(&f->space, rgb, ycc);
        for (int c = 0; c < 3; c++)
            seen[c][i] = ycc[c];
        achromatic[i] = (ycc[0] + 16) / 116;
    }
    detect(s, achromatic, false, s->feature[0]);
    detect(s, achromatic, true, s->feature[1]); /* reads before it writes */
    for (int c = 0; c < 3; c++)
        blur_channel(s, seen[c], c);
    for (size_t i = 0; i < f->pixels; i++) {
        double ycc[3] = {seen[0][i], seen[1][i], seen[2][i]}, rgb[3], lab[3];
        metrics_from_opponent(&f->space, ycc, rgb);
        for (int c = 0; c < 3; c++)
            rgb[c] = fmin(fmax(rgb[c], 0), 1);
        metrics_hunt_lab(&f->space, rgb, lab);
        for (int c = 0; c < 3; c++)
            seen[c][i] = lab[c];
    }
    return NULL;
}

/* Both, in a thread each where there can be another one. */
static void look_at_both(struct sight sights[2])
{
    pthread_t thread;
    bool apart = pthread_create(&thread, NULL, look_at, &sights[0]) == 0;
    look_at(&sights[1]);
    if (apart)
        pthread_join(thread, NULL);
    else
        look_at(&sights[0]);
}

static double hyab(const double a[3], const double b[3])
{
    return fabs(a[0] - b[0]) + hypot(a[1] - b[1], a[2] - b[2]);
}

/* The largest colour error there is: green against blue. */
static double largest_error(const struct metrics_colour *space)
{
    const double green[3] = {0, 1, 0}, blue[3] = {0, 0, 1};
    double a[3], b[3];
    metrics_hunt_lab(space, green, a);
    metrics_hunt_lab(space, blue, b);
    return pow(hyab(a, b), COLOUR_EXPONENT);
}

/* Spreads colour errors over [0,1]: linear up to the knee, and from there. */
static double spread(double error, double largest)
{
    double knee = COLOUR_KNEE * largest;
    if (error < knee)
        return error * KNEE_VALUE / knee;
    return KNEE_VALUE + (error - knee) / (largest - knee) * (1 - KNEE_VALUE);
}

bool pen_metrics_flip(const struct pen_metrics_image *test,
    const struct pen_metrics_image *reference, double pixels_per_degree, float *map, double *mean,
    struct pen_error *error)
{
    if (!metrics_check(test, reference, 3, error))
        return false;
    struct flip f = {.width = test->width,
        .height = test->height,
        .pixels = (size_t)test->width * test->height,
        .pixels_per_degree = pixels_per_degree > 0 ? pixels_per_degree : PIXELS_PER_DEGREE,
        .space = metrics_colour_srgb()};
    if (!(f.pixels_per_degree >= 4 && f.pixels_per_degree <= 1000)) /* the filters' radius */
        return pen_fail(error, PEN_INVALID, "", "There must be 4 to 1000 pixels per degree.");
    double *memory = malloc(2 * SIGHT_PLANES * f.pixels * sizeof *memory), *next = memory, sum = 0;
    if (!memory)
        return pen_fail(error, PEN_UNAVAILABLE, "", "Out of memory.");
    struct sight sights[2] = {{.flip = &f, .image = test}, {.flip = &f, .image = reference}};
    for (int i = 0; i < 2; i++) {
        for (int c = 0; c < 3; c++, next += f.pixels)
            sights[i].seen[c] = next;
        for (int c = 0; c < 2; c++, next += f.pixels)
            sights[i].feature[c] = next;
        for (int c = 0; c < 3; c++, next += f.pixels)
            sights[i].scratch[c] = next;
    }
    look_at_both(sights);
    double largest = largest_error(&f.space);
    for (size_t i = 0; i < f.pixels; i++) {
        double a[3], b[3];
        for (int c = 0; c < 3; c++) {
            a[c] = sights[0].seen[c][i];
            b[c] = sights[1].seen[c][i];
        }
        double colour = spread(pow(hyab(a, b), COLOUR_EXPONENT), largest);
        double feature = fmax(fabs(sights[0].feature[0][i] - sights[1].feature[0][i]),
            fabs(sights[0].feature[1][i] - sights[1].feature[1][i]));
        double value = pow(colour, 1 - pow(feature / M_SQRT2, FEATURE_EXPONENT));
        sum += value;
        if (map)
            map[i] = (float)value;
    }
    *mean = sum / (double)f.pixels;
    free(memory);
    return true;
}
