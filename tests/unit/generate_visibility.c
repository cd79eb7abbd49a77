/* The closed-form scenes are what the closed forms say: rays from points of the receiver to a grid
 * on the light, against the triangles of the blob (and the texels of the mask). */
#include "renderer/generate/generate.h"
#include "tests/unit/check.h"

enum { GRID = 64 }; /* light samples per side: V is exact to about 1 / GRID at a straight edge */

static struct psc_scene scene;
static void *blob;

static void make(struct pen_generated_options options)
{
    free(blob);
    struct pen_error error = {0};
    size_t bytes;
    if (!pen_generate_blob(&options, &blob, &bytes, &error) ||
        !psc_open_memory(blob, bytes, &scene, &error)) {
        fprintf(stderr, "%s\n", error.message);
        exit(1);
    }
}

static bool in_mask(const struct psc_material *m, double u, double v)
{
    const struct psc_image *image = &scene.images[scene.textures[m->base.texture].image];
    int x = (int)floor(u * image->width), y = (int)floor(v * image->height);
    x = x < 0 ? 0 : x >= (int)image->width ? (int)image->width - 1 : x;
    y = y < 0 ? 0 : y >= (int)image->height ? (int)image->height - 1 : y;
    const uint8_t *texel = scene.texels + image->first_byte + 4 * (y * (int)image->width + x);
    return texel[3] / 255.0 >= m->alpha_cutoff;
}

/* Whether the segment from p to q meets a triangle of the instance away from its ends. */
static bool blocked_by(const struct psc_instance *instance, const double p[3], const double q[3])
{
    const struct psc_primitive *primitive = &scene.primitives[instance->primitive];
    const struct psc_material *material = &scene.materials[primitive->material];
    for (uint32_t i = 0; i < primitive->index_count; i += 3) {
        const uint32_t *t = &scene.indices[primitive->first_index + i];
        double w[3][3], d[3], e[3], f[3], s[3];
        for (int c = 0; c < 3; c++)
            for (int r = 0; r < 3; r++) {
                const float *m = instance->world + 4 * r, *x = scene.positions[t[c]];
                w[c][r] = (double)m[0] * x[0] + (double)m[1] * x[1] + (double)m[2] * x[2] + m[3];
            }
        for (int r = 0; r < 3; r++) {
            d[r] = q[r] - p[r];
            e[r] = w[1][r] - w[0][r];
            f[r] = w[2][r] - w[0][r];
            s[r] = p[r] - w[0][r];
        }
        const double df[3] = {
            d[1] * f[2] - d[2] * f[1], d[2] * f[0] - d[0] * f[2], d[0] * f[1] - d[1] * f[0]};
        const double se[3] = {
            s[1] * e[2] - s[2] * e[1], s[2] * e[0] - s[0] * e[2], s[0] * e[1] - s[1] * e[0]};
        double det = e[0] * df[0] + e[1] * df[1] + e[2] * df[2];
        if (fabs(det) < 1e-14)
            continue;
        double u = (s[0] * df[0] + s[1] * df[1] + s[2] * df[2]) / det;
        double v = (d[0] * se[0] + d[1] * se[1] + d[2] * se[2]) / det;
        double along = (f[0] * se[0] + f[1] * se[1] + f[2] * se[2]) / det;
        if (u < 0 || v < 0 || u + v > 1 || along < 1e-5 || along > 1)
            continue;
        if (material->alpha_mode != PSC_MASK)
            return true;
        double uv[2];
        for (int k = 0; k < 2; k++)
            uv[k] = (1 - u - v) * scene.attributes[t[0]].uv[0][k] +
                    u * scene.attributes[t[1]].uv[0][k] + v * scene.attributes[t[2]].uv[0][k];
        if (in_mask(material, uv[0], uv[1]))
            return true;
    }
    return false;
}

/* Share of a horizontal square light (half side a, centred above the origin or elsewhere) seen from
 * r; only: the instance that may block, or -1 for all. */
static double visibility(const double r[3], const double light[3], double a, int only)
{
    int seen = 0;
    for (int i = 0; i < GRID; i++)
        for (int j = 0; j < GRID; j++) {
            const double q[3] = {light[0] + a * (2 * (i + 0.5) / GRID - 1), light[1],
                light[2] + a * (2 * (j + 0.5) / GRID - 1)};
            bool blocked = false;
            for (uint32_t k = 0; k < scene.instance_count && !blocked; k++)
                blocked = (only < 0 || (int)k == only) && blocked_by(&scene.instances[k], r, q);
            seen += !blocked;
        }
    return (double)seen / (GRID * GRID);
}

static double clamp01(double x)
{
    return x < 0 ? 0 : x > 1 ? 1 : x;
}

static const double above[3] = {0, 3, 0};

static void half_plane(void)
{
    const double heights[] = {0.3, 1.2, 2.0}, a = 0.5;
    for (int h = 0; h < 3; h++) {
        make((struct pen_generated_options){
            .kind = PEN_GENERATED_HALF_PLANE, .caster_height = (float)heights[h]});
        double rz = 3, cz = 3 - heights[h]; /* from the light */
        for (double x = -3.9; x <= 3.9; x += fabs(x) < 1.2 ? 0.05 : 0.3) {
            const double r[3] = {x, 0, 0.7 * x};
            double v = clamp01(0.5 + x * cz / (2 * a * (rz - cz)));
            CHECK_NEAR(visibility(r, above, a, -1), v, 1.0 / GRID);
        }
    }
}

/* Share of -a..a that lies in the shadow of -h..h, seen from x. */
static double overlap(double x, double a, double h, double cz, double rz)
{
    double k = cz / rz, low = (-h - x * k) / (1 - k), high = (h - x * k) / (1 - k);
    return fmax(0, fmin(a, high) - fmax(-a, low)) / (2 * a);
}

static void square(void)
{
    const double a = 0.4, h = 0.55, cz = 2.1, rz = 3;
    make((struct pen_generated_options){
        .kind = PEN_GENERATED_SQUARE, .caster_height = 0.9f, .caster_half_size = (float)h});
    for (double x = -1.4; x <= 1.4; x += 0.17)
        for (double z = -1.3; z <= 1.3; z += 0.31) {
            const double r[3] = {x, 0, z};
            double v = 1 - overlap(x, a, h, cz, rz) * overlap(z, a, h, cz, rz);
            CHECK_NEAR(visibility(r, above, a, -1), v, 2.0 / GRID);
        }
}

/* Where the lower caster alone hides the light, the upper one's edge still crosses the light: the
 * place where a filter of depths leaks. */
static void stacked(void)
{
    make((struct pen_generated_options){.kind = PEN_GENERATED_STACKED});
    CHECK(scene.instance_count == 3);
    int crossed = 0;
    for (double x = -3.9; x < -0.13; x += 0.06) { /* half penumbra of the lower: 0.125 m */
        const double r[3] = {x, 0, 0.2};
        CHECK(visibility(r, above, 0.5, -1) == 0);
        double upper = visibility(r, above, 0.5, 1);
        crossed += upper > 0.05 && upper < 0.95;
    }
    CHECK(crossed >= 5);
}

static void duplicate(void)
{
    make((struct pen_generated_options){.kind = PEN_GENERATED_DUPLICATE});
    CHECK(scene.instance_count == 3);
    const double origin[3] = {0, 0, 0};
    CHECK_NEAR(visibility(origin, above, 0.5, 1), 0.5, 1e-9);
    CHECK_NEAR(visibility(origin, above, 0.5, 2), 0.5, 1e-9);
    CHECK_NEAR(visibility(origin, above, 0.5, -1), 0.5, 1e-9);
}

static void planar_mask(void)
{
    make((struct pen_generated_options){
        .kind = PEN_GENERATED_PLANAR_MASK, .caster_half_size = 0.8f});
    const double a = 0.3, h = 0.8, cz = 1.8, rz = 3;
    const struct psc_material *m = &scene.materials[scene.primitives[1].material];
    CHECK(m->alpha_mode == PSC_MASK && m->flags == PSC_DOUBLE_SIDED);
    int partial = 0;
    for (double x = -1.5; x <= 1.5; x += 0.21)
        for (double z = -1.5; z <= 1.5; z += 0.23) {
            const double r[3] = {x, 0, z};
            /* Mask convolved with the light's image: each scaled onto the caster's plane. */
            int hidden = 0;
            for (int i = 0; i < GRID; i++)
                for (int j = 0; j < GRID; j++) {
                    double k = cz / rz, px = x * k + (1 - k) * a * (2 * (i + 0.5) / GRID - 1);
                    double pz = z * k + (1 - k) * a * (2 * (j + 0.5) / GRID - 1);
                    if (fabs(px) < h && fabs(pz) < h)
                        hidden += in_mask(m, (px + h) / (2 * h), (pz + h) / (2 * h));
                }
            double v = 1 - (double)hidden / (GRID * GRID);
            partial += v > 0.05 && v < 0.95;
            CHECK_NEAR(visibility(r, above, a, -1), v, 2e-3);
        }
    CHECK(partial > 20);
}

/* Nothing shadows anything: from near the corners of every triangle to lights around them. */
static void no_shadow(uint32_t kind)
{
    make((struct pen_generated_options){.kind = kind});
    const double lights[][3] = {{0, 3, 0}, {2, 1.5, -3}, {-3.5, 1.6, 3}, {7, 2.5, 1}};
    for (int l = 0; l < 4; l++)
        for (uint32_t k = 0; k < scene.instance_count; k++) {
            const struct psc_instance *instance = &scene.instances[k];
            const struct psc_primitive *p = &scene.primitives[instance->primitive];
            for (uint32_t n = 0; n < p->index_count; n++) { /* three points of each triangle */
                uint32_t i = n / 3 * 3;
                double r[3];
                for (int row = 0; row < 3; row++) {
                    const float *m = instance->world + 4 * row;
                    r[row] = m[3];
                    for (int c = 0; c < 3; c++) {
                        const float *x = scene.positions[scene.indices[p->first_index + i + c]];
                        double weight = c == (int)(n % 3) ? 0.99 : 0.005;
                        r[row] += weight * (m[0] * x[0] + m[1] * x[1] + m[2] * x[2]);
                    }
                }
                CHECK(visibility(r, lights[l], 0.3, -1) == 1);
            }
        }
}

int main(void)
{
    half_plane();
    square();
    stacked();
    duplicate();
    planar_mask();
    no_shadow(PEN_GENERATED_PLANE);
    no_shadow(PEN_GENERATED_EMPTY_ROOM);
    free(blob);
    CHECK_DONE();
}
