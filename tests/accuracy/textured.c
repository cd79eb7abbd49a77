#include "tests/accuracy/textured.h"
#include "renderer/blob/builder.h"
#include "tests/unit/check.h"
#include <sys/mman.h>
#include <unistd.h>

void textured_image(uint32_t number, uint32_t w, uint32_t h, uint32_t count, const uint8_t *rgba,
    uint8_t id[PEN_ID_BYTES])
{
    struct pen_error error = {0};
    struct psc_builder *builder = psc_builder_create();
    void *data;
    size_t bytes;
    memset(id, 0, PEN_ID_BYTES);
    id[0] = 0xe1, id[1] = (uint8_t)number;
    struct psc_material material = psc_material_default();
    psc_builder_add_material(builder, &material);
    for (uint32_t i = 0; i < count; i++)
        psc_builder_add_image(builder, w, h, false, rgba + (size_t)4 * w * h * i);
    int fd = memfd_create("image", MFD_CLOEXEC);
    if (!psc_builder_finish(builder, id, &data, &bytes, &error) || fd < 0 ||
        write(fd, data, bytes) != (ssize_t)bytes ||
        !pen_renderer_load_image(harness_renderer(), id, fd, &error)) {
        fprintf(stderr, "image: %s\n", error.message);
        exit(1);
    }
    close(fd);
    free(data);
    psc_builder_destroy(builder);
}

#define FACING_DOWN(up)                                                                            \
    "&light.type=rect&light.position=0,3,0&light.target=0,0,0&light.width=1&light.height=1"        \
    "&light.up=" up

const char *textured_light(int axis, int sign)
{
    /* The light shines down; its x axis is up x (0, -1, 0), its y axis is up itself. */
    static const char *const lights[2][2] = {
        {FACING_DOWN("0,0,-1"), FACING_DOWN("0,0,1")},
        {FACING_DOWN("-1,0,0"), FACING_DOWN("1,0,0")},
    };
    return lights[axis][sign > 0];
}

double textured_t5(
    const struct shot *shot, const struct planar_case *t, bool red_is_right, double *worst)
{
    double sums[2] = {0}, most = 0;
    uint32_t pixels = 0;
    for (uint32_t i = 0; i < shot->width * shot->height; i++) {
        const float *p = shot->position + 4 * i, *v = shot->visibility + 4 * i;
        if (fabsf(p[1]) > 1e-3f || shot->normal[4 * i + 1] < 0.5f)
            continue;
        double cut = -p[0] * (t->h - t->c) / t->c; /* light points right of it are seen */
        cut = fmax(-t->a, fmin(t->a, cut));
        double right = (t->a - fmax(0, cut)) / (2 * t->a), left = fmax(0, -cut) / (2 * t->a);
        double total = left + right;
        CHECK(v[2] == 0);
        if (total <= 0.02 || total >= 0.98)
            continue;
        double e[2] = {v[0] - (red_is_right ? right : left), v[1] - (red_is_right ? left : right)};
        for (int k = 0; k < 2; k++) {
            sums[k] += e[k] * e[k];
            most = fmax(most, fabs(e[k]));
        }
        pixels++;
    }
    CHECK(pixels > 1000);
    if (worst)
        *worst = most;
    return sqrt(fmax(sums[0], sums[1]) / pixels);
}

double textured_difference(const struct shot *a, const struct shot *b, double *worst)
{
    double sum = 0, most = 0;
    uint32_t n = a->width * a->height;
    for (uint32_t i = 0; i < n; i++)
        for (int k = 0; k < 3; k++) {
            double e = a->visibility[4 * i + k] - b->visibility[4 * i + k];
            sum += e * e;
            most = fmax(most, fabs(e));
        }
    if (worst)
        *worst = most;
    return sqrt(sum / (3.0 * n));
}

/* The image of number 2. */
#define TOP_RED "e102000000000000000000000000000000000000000000000000000000000000"

void textured_check_t5(
    const uint8_t id[PEN_ID_BYTES], const char *method, const struct planar_case *t, double most)
{
    static const uint8_t red_green[2 * 4] = {255, 0, 0, 255, 0, 255, 0, 255};
    uint8_t image[PEN_ID_BYTES];
    textured_image(2, 1, 2, 1, red_green, image); /* top red */
    for (int i = 0; i < 4; i++) {
        int axis = i >> 1, sign = i & 1 ? 1 : -1;
        char text[640];
        struct shot shot;
        double worst;
        snprintf(text, sizeof text, "%s" HARNESS_VIEW "%s&light.texture.%s", method,
            textured_light(axis, sign), axis ? "image=" TOP_RED : "pattern=two-colour");
        harness_shot(id, text, &shot);
        double rmse = textured_t5(&shot, t, axis ? sign > 0 : sign < 0, &worst);
        fprintf(stderr, "T5 axis %d%+d: rmse %.5f worst %.4f\n", axis, sign, rmse, worst);
        CHECK(rmse < most);
        for (uint32_t k = 0; k < shot.width * shot.height; k++)
            CHECK_NEAR(shot.visibility[4 * k] + shot.visibility[4 * k + 1],
                shot.visibility[4 * k + 3], 0.06);
        harness_shot_finish(&shot);
    }
}
