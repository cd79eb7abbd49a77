/* Blended surfaces at one frame: stacks of them against the over operator (Porter and Duff 1984) in
 * linear light, whatever the order in the file, and light and shadow on what lies behind them. */
#include "tests/accuracy/quads.h"
#include "tests/unit/check.h"
#include <math.h>

#define SIDE 64
#define PIXELS (SIDE * SIDE)
#define MOST 12
#define PEELED 7 /* exactly; all that lies behind is right in the mean */

static const double backdrop[3] = {0.125, 0.25, 0.5};
static const float wall[4] = {0.75f, 0.5f, 0.25f, 1};

#define VIEW                                                                                       \
    "width=64&height=64&ground=off&sky=off&exposure_ev=0&camera.eye=0,0,3&camera.target=0,0,0"     \
    "&camera.fov_y_deg=30"
/* Behind everything that faces the eye. */
#define DARK                                                                                       \
    "&light.type=rect&light.position=0,0,-9&light.target=0,0,9&light.width=1"                      \
    "&light.height=1"

/* Quad i of a stack, nearest first; they fill the picture. */
static struct quad stacked(uint32_t i)
{
    static const float alphas[] = {
        0.25f, 0.6f, 0.4f, 0.5f, 0.3f, 0.7f, 0.2f, 0.45f, 0.15f, 0.35f, 0.55f, 0.65f};
    struct quad q = {.center = {0, 0, -0.1f * (float)i}, .half_u = {2, 0, 0}, .half_v = {0, 2, 0}};
    for (int k = 0; k < 3; k++)
        q.color[k] = 0.25f * (float)((i + (uint32_t)k * 2) % 5);
    q.color[3] = alphas[i];
    return q;
}

/* What `count` of them show, over the wall or the backdrop: premultiplied colour and alpha. */
static void over(uint32_t count, bool on_wall, bool transparent, double result[4])
{
    double left = 1;
    for (int k = 0; k < 4; k++)
        result[k] = 0;
    for (uint32_t i = 0; i < count; i++) {
        struct quad q = stacked(i);
        for (int k = 0; k < 3; k++)
            result[k] += left * q.color[3] * q.color[k];
        left *= 1 - q.color[3];
    }
    for (int k = 0; k < 3; k++)
        result[k] += left * (on_wall ? wall[k] : transparent ? 0 : backdrop[k]);
    result[3] = on_wall || !transparent ? 1 : 1 - left;
}

static void load_stack(uint32_t count, bool reversed, uint8_t id[PEN_ID_BYTES])
{
    struct quad quads[MOST + 1];
    for (uint32_t i = 0; i < count; i++)
        quads[reversed ? count - 1 - i : i] = stacked(i);
    quads[count] =
        (struct quad){.center = {-1, 0, -1.5f}, .half_u = {1, 0, 0}, .half_v = {0, 2, 0}};
    memcpy(quads[count].color, wall, sizeof wall);
    load_quads(quads, count + 1, true, id);
}

static bool is_wall(uint32_t pixel)
{
    return pixel % SIDE < SIDE / 2;
}

static void check_stack(uint32_t count, const char *more, bool transparent)
{
    char settings[512];
    uint8_t id[2][PEN_ID_BYTES];
    struct shot shots[2];
    double mean[2][4] = {{0}}, worst = 0;
    snprintf(settings, sizeof settings, "%s%s&technique=hard%s&background=%s", VIEW, DARK, more,
        transparent ? "transparent" : "0.125,0.25,0.5");
    for (int i = 0; i < 2; i++) {
        load_stack(count, i == 1, id[i]);
        harness_shot(id[i], settings, &shots[i]);
    }
    CHECK(!memcmp(shots[0].beauty, shots[1].beauty, sizeof(float) * 4 * PIXELS));
    for (uint32_t p = 0; p < PIXELS; p++) {
        double truth[4];
        over(count, is_wall(p), transparent, truth);
        for (int k = 0; k < 4; k++) {
            double error = shots[0].beauty[4 * p + k] - truth[k];
            mean[is_wall(p)][k] += error / (PIXELS / 2);
            worst = fmax(worst, fabs(error));
        }
    }
    double bias = 0;
    for (int k = 0; k < 8; k++)
        bias = fmax(bias, fabs(mean[k / 4][k % 4]));
    printf("%u quads%s%s: worst %.5f, bias %.5f\n", count, more, transparent ? ", transparent" : "",
        worst, bias);
    if (count <= PEELED)
        CHECK(worst < (count <= 4 ? 1e-4 : 5e-4)); /* a tenth of an 8-bit step */
    /* The share of light that reaches the hashed layer is at most (1 - .25) (1 - .6) (1 - .4); with
     * it the deviation of a mean over half the pixels is below .18 / 2 / 45. */
    CHECK(bias < 0.005);
    CHECK(worst < 0.19);
    harness_shot_finish(&shots[0]);
    harness_shot_finish(&shots[1]);
}

/* A great many do not cost more than the layers that are drawn. */
static void check_bounded(void)
{
    static struct quad quads[200];
    uint8_t id[PEN_ID_BYTES];
    struct shot shot;
    double mean[3] = {0};
    for (uint32_t i = 0; i < 200; i++)
        quads[i] = (struct quad){.center = {0, 0, -5e-3f * (float)i},
            .half_u = {2, 0, 0},
            .half_v = {0, 2, 0},
            .color = {0.5f, 0.25f, 1, 0.05f}};
    load_quads(quads, 200, true, id);
    harness_shot(id, VIEW DARK "&technique=none&background=0,0,0", &shot);
    for (uint32_t p = 0; p < PIXELS; p++)
        for (int k = 0; k < 3; k++)
            mean[k] += shot.beauty[4 * p + k] / PIXELS;
    /* Layers, what is solid, and what data layers are about. */
    CHECK(shot.result.full_work_pixels <= (PEELED + 1 + 1 + 1) * PIXELS);
    for (int k = 0; k < 3; k++)
        CHECK(fabs(mean[k] - quads[0].color[k]) < 0.005);
    harness_shot_finish(&shot);
}

/* A pane before a wall, both half in the shadow of a blind: with alpha a it shows a times what it
 * shows with 1, and the rest of what is there without it. */
static void check_light(const char *method)
{
    static const float alphas[] = {1, 0.4f, 0};
    char settings[512];
    struct shot shots[3];
    double worst = 0, error = 0, darkest = 1, brightest = 0;
    uint32_t count = 0;
    snprintf(settings, sizeof settings,
        "%s&background=0,0,0&technique=%s&light.type=rect&light.position=9,0,4"
        "&light.target=0,0,-1&light.width=.1&light.height=.1&light.radiance=20000",
        VIEW, method);
    for (int i = 0; i < 3; i++) {
        uint8_t id[PEN_ID_BYTES];
        struct quad quads[] = {
            {{0, 0, -2}, {4, 0, 0}, {0, 4, 0}, {0.5f, 0.5f, 0.5f, 1}},
            {{0, 0, 0}, {0.3f, 0, 0}, {0, 0.5f, 0}, {0.9f, 0.2f, 0.1f, alphas[i]}},
            {{3.5f, 2, 1.3f}, {0.7f, 0, 0}, {0, 2, 0}, {0, 0, 0, 1}},
        };
        load_quads(quads, 3, false, id);
        harness_shot(id, settings, &shots[i]);
    }
    for (uint32_t p = 0; p < PIXELS; p++) {
        if (shots[0].position[4 * p + 2] < -0.1f)
            continue; /* the wall beside it */
        count++;
        for (int k = 0; k < 3; k++) {
            double truth = alphas[1] * shots[0].beauty[4 * p + k] +
                           (1 - alphas[1]) * shots[2].beauty[4 * p + k];
            error += fabs(shots[1].beauty[4 * p + k] - truth);
            worst = fmax(worst, fabs(shots[1].beauty[4 * p + k] - truth));
        }
        darkest = fmin(darkest, shots[1].beauty[4 * p]);
        brightest = fmax(brightest, shots[1].beauty[4 * p]);
    }
    printf("%-10s light on %u pixels of a pane, %.3f to %.3f: mean error %.5f, worst %.5f\n",
        method, count, darkest, brightest, error / (3 * fmax(count, 1)), worst);
    CHECK(count > 200);
    CHECK(darkest < 0.5 * brightest); /* the blind's shadow is there */
    CHECK(error < 1e-3 * brightest * 3 * count);
    for (int i = 0; i < 3; i++)
        harness_shot_finish(&shots[i]);
}

int main(void)
{
    for (uint32_t count = 0; count <= PEELED; count++)
        check_stack(count, "", false);
    check_stack(2, "", true);
    check_stack(PEELED, "&antialias=2", false);
    check_stack(MOST, "", false);
    check_stack(MOST, "", true);
    check_bounded();
    check_light("hard");
    check_light("pcss");
    CHECK_DONE();
}
