/* Which surfaces cast: facing, mirrored instances, alpha in all its forms, the ground; and soups of
 * triangles against a slow intersection of our own. */
#include "tests/unit/trace_fixture.h"

static const float wide[2] = {-20, 20}, view[2] = {-1, 1};

static uint32_t random_state = 1;
static bool front_only; /* what main asks of every job */

static double uniform(double low, double high)
{
    random_state = random_state * 1664525u + 1013904223u;
    return low + (high - low) * (random_state >> 8) / (1 << 24);
}

/* Mean visibility over the grid of a light of half-extent `half`; destroys the scene. */
static double mean_visibility(struct pen_trace_scene *scene, float half, uint32_t samples)
{
    struct receivers *r = grid_receivers(view, view);
    struct pen_trace_job job = job_of(r, samples);
    job.front_only = front_only;
    struct pen_trace_light light = downward_light(PEN_TRACE_RECT, half);
    double sum = 0;
    trace(scene, &light, &job, r);
    for (int i = 0; i < GRID * GRID; i++)
        sum += (double)r->visibility[i][3];
    free(r);
    pen_trace_scene_destroy(scene);
    return sum / (GRID * GRID);
}

static double visibility_under(bool down, bool double_sided, bool mirrored)
{
    const float mirror[12] = {-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    struct psc_builder *builder = psc_builder_create();
    add_rectangle(builder, wide, wide, 1, down, add_plain_material(builder, double_sided),
        mirrored ? mirror : identity);
    return mean_visibility(finish_scene(builder, NULL), 0.5f, 16);
}

static void test_facing(void)
{
    CHECK(visibility_under(false, false, false) == 0);
    CHECK(visibility_under(true, false, false) == front_only);
    CHECK(visibility_under(true, true, false) == 0);
    CHECK(visibility_under(false, false, true) == 0);
    CHECK(visibility_under(true, false, true) == front_only);
    CHECK(visibility_under(true, true, true) == 0);
}

struct look {
    uint32_t mode;
    float factor, cutoff;
    uint8_t texel; /* alpha of a 1 x 1 texture; 255: no texture */
    uint8_t vertex;
    bool double_sided, down;
    uint32_t layers;
};

/* A wide sheet (or several) of one alpha. */
static double visibility_through(const struct look *look)
{
    static const uint32_t order[2][6] = {{0, 2, 1, 0, 3, 2}, {0, 1, 2, 0, 2, 3}};
    struct psc_builder *builder = psc_builder_create();
    struct psc_material material = psc_material_default();
    material.flags = look->double_sided ? PSC_DOUBLE_SIDED : 0;
    material.alpha_mode = look->mode;
    material.alpha_cutoff = look->cutoff;
    material.base_color[3] = look->factor;
    if (look->texel != 255) {
        const uint8_t rgba[4] = {255, 255, 255, look->texel};
        struct psc_texture texture = {.image = psc_builder_add_image(builder, 1, 1, true, rgba)};
        material.base.texture = (int32_t)psc_builder_add_texture(builder, &texture);
    }
    uint32_t number = psc_builder_add_material(builder, &material);
    for (uint32_t i = 0; i < look->layers; i++) {
        float y = 0.5f + 0.25f * (float)i, a = (float)look->vertex / 255;
        const float positions[4][3] = {{-20, y, -20}, {20, y, -20}, {20, y, 20}, {-20, y, 20}};
        const float colors[4][4] = {{1, 1, 1, a}, {1, 1, 1, a}, {1, 1, 1, a}, {1, 1, 1, a}};
        struct psc_mesh mesh = {.positions = positions,
            .colors = colors,
            .vertex_count = 4,
            .indices = order[look->down],
            .index_count = 6,
            .material = number};
        uint32_t primitive;
        CHECK(psc_builder_add_mesh(builder, &mesh, &primitive, NULL));
        psc_builder_add_instance(builder, primitive, identity);
    }
    return mean_visibility(finish_scene(builder, NULL), 0.5f, 64);
}

static void test_alpha(void)
{
    /* The cutoff itself counts as solid. */
    CHECK(visibility_through(&(struct look){PSC_MASK, 1, 0.5f, 127, 255, true, false, 1}) == 1);
    CHECK(visibility_through(&(struct look){PSC_MASK, 1, 0.5f, 128, 255, true, false, 1}) == 0);
    CHECK(visibility_through(&(struct look){PSC_MASK, 0.5f, 0.5f, 255, 255, true, false, 1}) == 0);
    CHECK(visibility_through(&(struct look){PSC_MASK, 0.4f, 0.5f, 255, 255, true, false, 1}) == 1);
    CHECK(visibility_through(&(struct look){PSC_MASK, 1, 0.5f, 255, 100, true, false, 1}) == 1);
    CHECK(visibility_through(&(struct look){PSC_MASK, 1, 0.5f, 200, 200, true, false, 1}) == 0);
    CHECK(visibility_through(&(struct look){PSC_MASK, 1, 0.7f, 200, 200, true, false, 1}) == 1);
    /* An opaque material does not look at alpha. */
    CHECK(visibility_through(&(struct look){PSC_OPAQUE, 0.1f, 0.5f, 10, 255, true, false, 1}) == 0);
    /* What a sheet of alpha a lets through is 1 - a, of several the product. */
    CHECK_NEAR(visibility_through(&(struct look){PSC_BLEND, 0.3f, 0, 255, 255, true, false, 1}),
        0.7, 1e-6);
    CHECK_NEAR(visibility_through(&(struct look){PSC_BLEND, 0.3f, 0, 255, 255, true, false, 2}),
        0.49, 1e-6);
    CHECK_NEAR(visibility_through(&(struct look){PSC_BLEND, 1, 0, 51, 102, true, false, 3}),
        0.92 * 0.92 * 0.92, 1e-6);
    CHECK_NEAR(visibility_through(&(struct look){PSC_BLEND, 0.3f, 0, 255, 255, false, false, 1}),
        0.7, 1e-6);
    CHECK((visibility_through(&(struct look){PSC_BLEND, 0.3f, 0, 255, 255, false, true, 1}) == 1) ==
          front_only);
    CHECK(visibility_through(&(struct look){PSC_BLEND, 1, 0, 255, 255, true, false, 1}) == 0);
    CHECK(visibility_through(&(struct look){PSC_BLEND, 0, 0, 255, 255, true, false, 1}) == 1);
}

/* A small plate under a light of half-extent 0.5. */
static void trace_plate(uint32_t type, uint32_t mode, float alpha, bool adaptive,
    uint32_t weighting, struct receivers *r)
{
    struct psc_builder *builder = psc_builder_create();
    struct psc_material material = psc_material_default();
    material.flags = PSC_DOUBLE_SIDED;
    material.alpha_mode = mode;
    material.base_color[3] = alpha;
    add_rectangle(builder, (float[2]){-0.37f, 0.21f}, (float[2]){-0.29f, 0.33f}, 1, false,
        psc_builder_add_material(builder, &material), identity);
    struct pen_trace_scene *scene = finish_scene(builder, NULL);
    struct pen_trace_light light = downward_light(type, 0.5f);
    struct pen_trace_job job = job_of(r, 64);
    job.adaptive = adaptive;
    job.weighting = weighting;
    trace(scene, &light, &job, r);
    pen_trace_scene_destroy(scene);
}

/* Every ray that meets the plate loses a share alpha, and no more: V = 1 - alpha (1 - V of an opaque
 * one) at every receiver, without noise, and so does the standard error shrink. */
static void test_blend_is_exact(void)
{
    static const uint32_t types[] = {
        PEN_TRACE_RECT, PEN_TRACE_DISK, PEN_TRACE_SPHERE, PEN_TRACE_POINT};
    struct receivers *solid = grid_receivers(view, view), *blended = grid_receivers(view, view);
    for (int k = 0; k < 16; k++) {
        uint32_t type = types[k % 4], weighting = k & 8 ? PEN_TRACE_G : PEN_TRACE_AREA;
        double alpha = k % 3 ? 0.02 : 0.6; /* the pre-test must not take the thin one for nothing */
        int wrong = 0;
        trace_plate(type, PSC_OPAQUE, 1, k & 4, weighting, solid);
        trace_plate(type, PSC_BLEND, (float)alpha, k & 4, weighting, blended);
        for (int i = 0; i < GRID * GRID; i++) {
            double hidden = alpha * (1 - (double)solid->visibility[i][3]);
            double off = fabs((double)blended->visibility[i][3] - (1 - hidden));
            wrong +=
                off > 1e-5 || (double)blended->error[i] > alpha * (double)solid->error[i] + 1e-5;
        }
        printf("plate %d: %d differ\n", k, wrong);
        CHECK(wrong <= 4); /* rays along its diagonal, which meet both triangles */
    }
    free(solid);
    free(blended);
}

/* Shadows of a point light through a textured sheet show the texture; every wrap mode and filter is
 * compared with a look-up of our own. */
static double wrapped(const uint8_t *alpha, int size, uint32_t mode, double s, double t)
{
    int index[2];
    double st[2] = {s, t};
    for (int k = 0; k < 2; k++) {
        int i = (int)floor(st[k] * size);
        if (mode == PSC_CLAMP)
            i = i < 0 ? 0 : i >= size ? size - 1 : i;
        else if (mode == PSC_REPEAT)
            i = ((i % size) + size) % size;
        else {
            i = ((i % (2 * size)) + 2 * size) % (2 * size);
            i = i < size ? i : 2 * size - 1 - i;
        }
        index[k] = i;
    }
    return alpha[index[1] * size + index[0]] / 255.0;
}

static void test_sampling(void)
{
    enum { SIZE = 4 };
    uint8_t rgba[SIZE * SIZE][4], alpha[SIZE * SIZE];
    for (int i = 0; i < SIZE * SIZE; i++) {
        alpha[i] = (uint8_t)uniform(0, 256);
        memset(rgba[i], 255, 3);
        rgba[i][3] = alpha[i];
    }
    for (uint32_t mode = PSC_REPEAT; mode <= PSC_MIRROR; mode++)
        for (uint32_t nearest = 0; nearest < 2; nearest++) {
            struct psc_builder *builder = psc_builder_create();
            struct psc_texture texture = {
                .image = psc_builder_add_image(builder, SIZE, SIZE, false, rgba[0]),
                .wrap_s = mode,
                .wrap_t = mode,
                .nearest = nearest};
            struct psc_material material = psc_material_default();
            material.flags = PSC_DOUBLE_SIDED;
            material.alpha_mode = PSC_MASK;
            material.alpha_cutoff = 0.5f;
            material.base.texture = (int32_t)psc_builder_add_texture(builder, &texture);
            const float transform[6] = {2.5f, 0, -0.7f, 0, -1.5f, 0.4f};
            memcpy(material.base.transform, transform, sizeof transform);
            const float size[2] = {-1, 1};
            add_rectangle(builder, size, size, 1.5f, false,
                psc_builder_add_material(builder, &material), identity);
            struct pen_trace_scene *scene = finish_scene(builder, NULL);
            struct receivers *r = grid_receivers((float[2]){-1.9f, 1.9f}, (float[2]){-1.9f, 1.9f});
            struct pen_trace_job job = job_of(r, 1);
            struct pen_trace_light light = downward_light(PEN_TRACE_POINT, 0);
            trace(scene, &light, &job, r);
            int wrong = 0;
            for (int i = 0; i < GRID * GRID; i++) {
                /* Half-way up, so the sheet is hit at half the receiver's place. */
                double u = ((double)r->positions[i][0] / 2 + 1) / 2;
                double v = ((double)r->positions[i][2] / 2 + 1) / 2;
                double s = 2.5 * u - 0.7, t = -1.5 * v + 0.4, a;
                if (nearest) {
                    a = wrapped(alpha, SIZE, mode, s, t);
                } else {
                    double fs = s * SIZE - 0.5, ft = t * SIZE - 0.5;
                    double x = fs - floor(fs), y = ft - floor(ft);
                    a = 0;
                    for (int k = 0; k < 4; k++)
                        a += (k & 1 ? x : 1 - x) * (k & 2 ? y : 1 - y) *
                             wrapped(alpha, SIZE, mode, (floor(fs) + (k & 1) + 0.5) / SIZE,
                                 (floor(ft) + (k >> 1) + 0.5) / SIZE);
                }
                if (fabs(a - 0.5) > 1e-3)
                    wrong += (r->visibility[i][3] == 0) != (a >= 0.5);
            }
            printf("wrap %u nearest %u: %d wrong\n", mode, nearest, wrong);
            CHECK(wrong <= (nearest ? 40 : 4)); /* float against double at texel borders */
            free(r);
            pen_trace_scene_destroy(scene);
        }
}

/* Soup: random triangles, a third double-sided, under random affine instances, some mirrored. */
#define SOUP 300
struct soup {
    double corner[SOUP][3][3];
    bool double_sided[SOUP];
};

static struct pen_trace_scene *make_soup(struct soup *soup)
{
    struct psc_builder *builder = psc_builder_create();
    uint32_t materials[2] = {add_plain_material(builder, false), add_plain_material(builder, true)};
    for (int i = 0; i < SOUP; i++) {
        float position[3][3], world[12];
        double m[12], determinant;
        for (int k = 0; k < 12; k++) {
            m[k] = (k % 5 == 0 ? 1 : 0) * (uniform(0, 1) < 0.5 ? -1 : 1) + uniform(-0.3, 0.3);
            world[k] = (float)m[k];
        }
        world[7] += 1.5f;
        for (int k = 0; k < 9; k++)
            position[k / 3][k % 3] = (float)uniform(-0.5, 0.5);
        determinant = m[0] * (m[5] * m[10] - m[6] * m[9]) - m[1] * (m[4] * m[10] - m[6] * m[8]) +
                      m[2] * (m[4] * m[9] - m[5] * m[8]);
        soup->double_sided[i] = i % 3 == 0;
        struct psc_mesh mesh = {.positions = position, .vertex_count = 3, .index_count = 3};
        mesh.material = materials[soup->double_sided[i]];
        uint32_t primitive;
        CHECK(psc_builder_add_mesh(builder, &mesh, &primitive, NULL));
        psc_builder_add_instance(builder, primitive, world);
        for (int k = 0; k < 3; k++) /* front faces stay front faces in a mirror */
            for (int c = 0; c < 3; c++)
                soup->corner[i][determinant < 0 && k ? 3 - k : k][c] =
                    (double)world[4 * c] * (double)position[k][0] +
                    (double)world[4 * c + 1] * (double)position[k][1] +
                    (double)world[4 * c + 2] * (double)position[k][2] + (double)world[4 * c + 3];
    }
    return finish_scene(builder, NULL);
}

static double triple(const double a[3], const double b[3], const double c[3])
{
    return a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
           a[2] * (b[0] * c[1] - b[1] * c[0]);
}

/* By signed volumes: does the triangle block the way from r to l? */
static bool blocks(const struct soup *soup, int i, const double r[3], const double l[3])
{
    double d[3], q[3][3], side[3];
    for (int c = 0; c < 3; c++) {
        d[c] = l[c] - r[c];
        for (int k = 0; k < 3; k++)
            q[k][c] = soup->corner[i][k][c] - r[c];
    }
    for (int k = 0; k < 3; k++)
        side[k] = triple(d, q[k], q[(k + 1) % 3]);
    bool along = side[0] > 0 && side[1] > 0 && side[2] > 0;
    bool against = side[0] < 0 && side[1] < 0 && side[2] < 0;
    if (!along && !against)
        return false;
    double t = triple(q[0], q[1], q[2]) / (side[0] + side[1] + side[2]);
    if (t <= 0 || t >= 0.9999)
        return false;
    double e1[3], e2[3];
    for (int c = 0; c < 3; c++) {
        e1[c] = q[1][c] - q[0][c];
        e2[c] = q[2][c] - q[0][c];
    }
    return !front_only || soup->double_sided[i] || triple(e1, e2, d) > 0;
}

static double slow_visibility(const struct soup *soup, const double r[3], const double l[3])
{
    for (int i = 0; i < SOUP; i++)
        if (blocks(soup, i, r, l))
            return 0;
    return 1;
}

static void test_soup(void)
{
    struct soup *soup = calloc(1, sizeof *soup);
    struct pen_trace_scene *scene = make_soup(soup);
    struct receivers *r = grid_receivers((float[2]){-2, 2}, (float[2]){-2, 2});
    int wrong = 0, shadowed = 0;
    for (int k = 0; k < 12; k++) { /* more lights than hierarchies are kept */
        struct pen_trace_light light = downward_light(PEN_TRACE_POINT, 0);
        double l[3];
        for (int c = 0; c < 3; c++) {
            light.origin[c] = (float)(c == 1 ? uniform(1, 4) : uniform(-2, 2));
            l[c] = (double)light.origin[c];
        }
        struct pen_trace_job job = job_of(r, 1);
        job.front_only = front_only;
        trace(scene, &light, &job, r);
        for (int i = 0; i < GRID * GRID; i++) {
            double p[3] = {(double)r->positions[i][0], 0, (double)r->positions[i][2]};
            wrong += slow_visibility(soup, p, l) != (double)r->visibility[i][3];
            shadowed += r->visibility[i][3] == 0;
        }
    }
    printf("soup: %d of %d in shadow, %d differ\n", shadowed, 12 * GRID * GRID, wrong);
    CHECK(wrong <= 12 * GRID * GRID / 2000); /* rays along an edge */
    CHECK(shadowed > 12 * GRID * GRID / 10 && shadowed < 12 * GRID * GRID * 9 / 10);

    /* An area light above and among the triangles: some planes cut it. */
    for (int k = 0; k < 3; k++) {
        struct pen_trace_light light = downward_light(k == 2 ? PEN_TRACE_DISK : PEN_TRACE_RECT, 1);
        light.origin[1] = k ? 1.6f : 3;
        struct pen_trace_job job = job_of(r, 1024);
        job.front_only = front_only;
        trace(scene, &light, &job, r);
        double squares = 0, most = 0;
        for (int i = 0; i < 64; i++) {
            int number = i * 63, hit = 0, tries = 6400; /* their own noise: 0.006 at most */
            double p[3] = {(double)r->positions[number][0], 0, (double)r->positions[number][2]};
            for (int t = 0; t < tries; t++) {
                double x = (t % 80 + uniform(0, 1)) / 80, y = (t / 80 + uniform(0, 1)) / 80;
                double u = k == 2 ? sqrt(x) * cos(2 * M_PI * y) : 2 * x - 1;
                double v = k == 2 ? sqrt(x) * sin(2 * M_PI * y) : 2 * y - 1;
                double l[3] = {u, (double)light.origin[1], v};
                hit += slow_visibility(soup, p, l) > 0;
            }
            double difference = hit / (double)tries - (double)r->visibility[number][3];
            squares += difference * difference;
            most = fmax(most, fabs(difference));
        }
        printf("soup, area light %d: RMSE %.4f, at most %.4f\n", k, sqrt(squares / 64), most);
        CHECK(sqrt(squares / 64) < 0.012);
        CHECK(most < 0.04);
    }
    free(r);
    free(soup);
    pen_trace_scene_destroy(scene);
}

static void test_ground(void)
{
    /* Receivers under the ground are in its shadow; those on it are not. */
    struct pen_trace_ground ground = {{0, 0.5f, 0}, 50};
    struct pen_trace_scene_options options = {.ground = &ground};
    struct psc_builder *builder = psc_builder_create();
    add_plain_material(builder, false);
    CHECK(mean_visibility(finish_scene(builder, &options), 0.5f, 16) == 0);
    ground.center[1] = 0;
    builder = psc_builder_create();
    add_plain_material(builder, false);
    CHECK(mean_visibility(finish_scene(builder, &options), 0.5f, 16) == 1);
}

int main(void)
{
    for (int front = 0; front < 2; front++) {
        front_only = front;
        test_facing();
        test_alpha();
        test_soup();
    }
    test_blend_is_exact();
    test_sampling();
    test_ground();
    CHECK_DONE();
}
