/* Normals, tangents, the watertight flag and meshlet bounds against closed forms
 * and brute force. */
#include "tests/unit/blob_shapes.h"

static void flat_normals_of_a_cube(void)
{
    struct psc_scene s;
    struct psc_mesh mesh = cube_mesh();
    void *data = build_one(&mesh, &s);
    CHECK(s.vertex_count == 36 && s.index_count == 36);
    for (uint32_t i = 0; i < 36; i++) {
        /* A cube's face normal is the mean of its corners' directions. */
        const struct psc_attributes *a = &s.attributes[s.indices[i]];
        int axis = -1;
        for (int k = 0; k < 3; k++)
            if (a->normal[k])
                axis = k;
        const float *p = s.positions[s.indices[i]];
        CHECK(axis >= 0 && a->normal[axis] == (p[axis] > 0 ? 32767 : -32767));
    }
    free(data);
}

static bool is_watertight(const struct psc_mesh *mesh)
{
    struct psc_scene s;
    void *data = build_one(mesh, &s);
    bool watertight = s.primitives[0].flags & PSC_WATERTIGHT;
    free(data);
    return watertight;
}

static bool is_outward(const struct psc_mesh *mesh)
{
    struct psc_scene s;
    void *data = build_one(mesh, &s);
    bool outward = s.primitives[0].flags & PSC_OUTWARD;
    free(data);
    return outward;
}

/* Two cubes, either turned inside out; the second far off or within the first. */
static void outward(void)
{
    for (int k = 0; k < 8; k++) {
        float twice[16][3];
        uint32_t indices[72];
        for (int i = 0; i < 16; i++)
            for (int c = 0; c < 3; c++)
                twice[i][c] =
                    cube_positions[i % 8][c] * (i < 8 ? 1 : 0.5f) + (i > 7 && k & 4 ? 1e4f : 0);
        for (int i = 0; i < 72; i++) {
            bool turned = k >> (i / 36) & 1;
            int corner = i % 3;
            int from = i % 36 - corner + (turned && corner ? 3 - corner : corner);
            indices[i] = cube_indices[from] + (i < 36 ? 0 : 8);
        }
        struct psc_mesh mesh = {.positions = (const float(*)[3])twice,
            .vertex_count = 16,
            .indices = indices,
            .index_count = 72};
        CHECK(is_watertight(&mesh));
        CHECK(is_outward(&mesh) == !(k & 3));
    }
    struct psc_mesh mesh = cube_mesh();
    mesh.index_count = 33; /* a hole */
    CHECK(!is_outward(&mesh));
}

static void watertight(void)
{
    struct psc_mesh mesh = cube_mesh();
    CHECK(is_watertight(&mesh));
    mesh.index_count = 33; /* a hole */
    CHECK(!is_watertight(&mesh));

    uint32_t indices[72];
    memcpy(indices, cube_indices, sizeof cube_indices);
    indices[1] = cube_indices[2]; /* one triangle turned over */
    indices[2] = cube_indices[1];
    mesh = cube_mesh();
    mesh.indices = indices;
    CHECK(!is_watertight(&mesh));

    memcpy(indices, cube_indices, sizeof cube_indices); /* every edge shared by four triangles */
    memcpy(indices + 36, cube_indices, sizeof cube_indices);
    mesh.index_count = 72;
    CHECK(!is_watertight(&mesh));

    float twice[16][3]; /* two cubes side by side, then two that share an edge */
    for (int shared = 0; shared < 2; shared++) {
        for (int i = 0; i < 16; i++)
            for (int k = 0; k < 3; k++)
                twice[i][k] = cube_positions[i % 8][k] + (i < 8 ? 0 : shared ? 2 * (k < 2) : 5);
        for (int i = 0; i < 36; i++)
            indices[36 + i] = cube_indices[i] + 8;
        mesh = (struct psc_mesh){.positions = (const float(*)[3])twice,
            .vertex_count = 16,
            .indices = indices,
            .index_count = 72};
        CHECK(is_watertight(&mesh) == !shared);
    }

    /* Minus zero is zero, and a triangle without area neither helps nor harms. */
    float flipped[8][3];
    for (int i = 0; i < 8; i++)
        for (int k = 0; k < 3; k++)
            flipped[i][k] = (cube_positions[i][k] + 1) / 2;
    float corners[36][3];
    for (int i = 0; i < 36; i++)
        for (int k = 0; k < 3; k++) {
            float x = flipped[cube_indices[i]][k];
            corners[i][k] = x == 0 && i % 2 ? -0.0f : x;
        }
    mesh = (struct psc_mesh){
        .positions = (const float(*)[3])corners, .vertex_count = 36, .index_count = 36};
    CHECK(is_watertight(&mesh));
    memcpy(indices, cube_indices, sizeof cube_indices);
    memcpy(indices + 36, (uint32_t[]){0, 1, 1}, 3 * sizeof *indices);
    mesh = cube_mesh();
    mesh.indices = indices;
    mesh.index_count = 39;
    CHECK(is_watertight(&mesh));
}

static void decode(const int16_t v[4], double out[3])
{
    for (int k = 0; k < 3; k++)
        out[k] = v[k] / 32767.0;
}

static void cross(const double a[3], const double b[3], double c[3])
{
    for (int k = 0; k < 3; k++)
        c[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
}

static const struct psc_texture_ref plain = {.transform = {1, 0, 0, 0, 1, 0}};

/* A strip of two quads in the plane z = 0 whose u is mirrored at x = 0, as on a symmetric body. */
static void tangents_of_mirrored_strip(void)
{
    const float positions[6][3] = {
        {-1, 0, 0}, {0, 0, 0}, {1, 0, 0}, {-1, 1, 0}, {0, 1, 0}, {1, 1, 0}};
    const float normals[6][3] = {{0, 0, 1}, {0, 0, 2}, {0, 0, 1}, {0, 0, 1}, {0, 0, 1}, {0, 0, 1}};
    const float uv[6][2] = {{1, 1}, {0, 1}, {1, 1}, {1, 0}, {0, 0}, {1, 0}};
    const uint32_t indices[12] = {0, 1, 4, 0, 4, 3, 1, 2, 5, 1, 5, 4};
    struct psc_mesh mesh = {.positions = positions,
        .normals = normals,
        .uv0 = uv,
        .vertex_count = 6,
        .indices = indices,
        .index_count = 12,
        .normal_map = &plain};
    struct psc_scene s;
    void *data = build_one(&mesh, &s);
    CHECK(s.vertex_count == 8); /* the two vertices on the seam are split */
    for (uint32_t i = 0; i < 12; i++) {
        const struct psc_attributes *a = &s.attributes[s.indices[i]];
        double n[3], t[3], b[3];
        decode(a->normal, n);
        decode(a->tangent, t);
        cross(n, t, b);
        double sign = a->tangent[3] / 32767.0;
        CHECK_NEAR(t[0], i < 6 ? -1 : 1, 1e-4); /* u grows away from the seam */
        CHECK_NEAR(sign * b[1], 1, 1e-4);       /* v grows downwards: the bitangent is up */
        CHECK(memcmp(s.positions[s.indices[i]], positions[indices[i]], 12) == 0);
        CHECK(memcmp(a->uv[0], uv[indices[i]], 8) == 0);
    }
    free(data);

    mesh.normal_map = NULL;
    data = build_one(&mesh, &s);
    CHECK(s.attributes[0].tangent[3] == 0 && s.attributes[0].tangent[0] == 0);
    free(data);
}

/* u is the longitude, so that the tangent is the direction of growing longitude. */
static void torus(uint32_t rings, uint32_t sides, double tube, float (*positions)[3],
    float (*normals)[3], float (*uv)[2], uint32_t *indices)
{
    for (uint32_t i = 0; i <= rings; i++)
        for (uint32_t j = 0; j <= sides; j++) {
            double u = 2 * M_PI * i / rings, v = 2 * M_PI * j / sides;
            uint32_t k = i * (sides + 1) + j;
            float n[3] = {(float)(cos(u) * cos(v)), (float)sin(v), (float)(-sin(u) * cos(v))};
            memcpy(normals[k], n, sizeof n);
            positions[k][0] = (float)(cos(u) + tube * n[0]);
            positions[k][1] = (float)(tube * n[1]);
            positions[k][2] = (float)(-sin(u) + tube * n[2]);
            uv[k][0] = (float)i / rings;
            uv[k][1] = 1 - (float)j / sides;
        }
    for (uint32_t i = 0; i < rings; i++)
        for (uint32_t j = 0; j < sides; j++) {
            uint32_t a = i * (sides + 1) + j, b = a + sides + 1;
            memcpy(indices, (uint32_t[]){a, b, b + 1, a, b + 1, a + 1}, 6 * sizeof *indices);
            indices += 6;
        }
}

enum { RINGS = 48, SIDES = 32, TORUS = (RINGS + 1) * (SIDES + 1), CORNERS = RINGS * SIDES * 6 };
static float torus_positions[TORUS][3], torus_normals[TORUS][3], torus_uv[TORUS][2];
static uint32_t torus_indices[CORNERS];

static struct psc_mesh torus_mesh(double tube)
{
    torus(RINGS, SIDES, tube, torus_positions, torus_normals, torus_uv, torus_indices);
    return (struct psc_mesh){.positions = (const float(*)[3])torus_positions,
        .normals = (const float(*)[3])torus_normals,
        .uv0 = (const float(*)[2])torus_uv,
        .vertex_count = TORUS,
        .indices = torus_indices,
        .index_count = CORNERS,
        .normal_map = &plain};
}

static void tangents_of_a_torus(void)
{
    struct psc_mesh mesh = torus_mesh(0.4);
    struct psc_scene s;
    void *data = build_one(&mesh, &s);
    CHECK(s.vertex_count == TORUS);
    for (uint32_t k = 0; k < TORUS; k++) {
        double u = 2 * M_PI * torus_uv[k][0], t[3], n[3];
        decode(s.attributes[k].tangent, t);
        decode(s.attributes[k].normal, n);
        CHECK_NEAR(t[0] * -sin(u) + t[2] * -cos(u), 1, 5e-3);
        CHECK_NEAR(t[0] * n[0] + t[1] * n[1] + t[2] * n[2], 0, 0.08); /* half a ring, 2 pi / 96 */
        CHECK(s.attributes[k].tangent[3] == 32767);
    }
    free(data);
}

/* For random eyes: a meshlet whose cone says "facing away" holds no triangle that faces the eye;
 * and the cones are tight enough to find many of those that do. */
static void meshlet_cones(void)
{
    uint64_t state = 7;
    uint32_t away = 0, culled = 0;
    for (int shape = 0; shape < 3; shape++) {
        struct psc_mesh mesh = torus_mesh(shape == 0 ? 0.1 : shape == 1 ? 0.5 : 0.9);
        uint32_t meshlets[CORNERS / 3], count = 0;
        for (uint32_t left = CORNERS / 3; left;) { /* runs of random length */
            uint32_t n = 1 + next_random(&state) % (shape ? 60 : 128);
            n = n < left ? n : left;
            meshlets[count++] = n;
            left -= n;
        }
        mesh.meshlet_triangles = meshlets;
        mesh.meshlet_count = count;
        struct psc_scene s;
        void *data = build_one(&mesh, &s);
        CHECK(s.meshlet_count == count);
        for (int e = 0; e < 60; e++) {
            double reach = e % 3 ? 8 : 1.2, eye[3];
            for (int k = 0; k < 3; k++)
                eye[k] = uniform(&state, -reach, reach);
            for (uint32_t m = 0; m < count; m++) {
                const struct psc_meshlet *let = &s.meshlets[m];
                bool faces = false;
                for (uint32_t i = 0; i < let->index_count; i += 3) {
                    const uint32_t *t = &s.indices[let->first_index + i];
                    double e1[3], e2[3], n[3], side = 0;
                    for (int k = 0; k < 3; k++) {
                        e1[k] = (double)s.positions[t[1]][k] - s.positions[t[0]][k];
                        e2[k] = (double)s.positions[t[2]][k] - s.positions[t[0]][k];
                    }
                    cross(e1, e2, n);
                    for (int k = 0; k < 3; k++)
                        side += n[k] * (eye[k] - s.positions[t[0]][k]);
                    faces |= side > 0;
                    for (int c = 0; c < 3; c++) {
                        double d = 0;
                        for (int k = 0; k < 3; k++)
                            d += pow((double)s.positions[t[c]][k] - let->center[k], 2);
                        CHECK(sqrt(d) <= let->radius);
                    }
                }
                double v[3], distance = 0, dot = 0;
                for (int k = 0; k < 3; k++) {
                    v[k] = let->center[k] - eye[k];
                    distance += v[k] * v[k];
                }
                distance = sqrt(distance);
                for (int k = 0; k < 3; k++)
                    dot += v[k] / distance * let->cone_axis[k];
                bool cull = dot >= let->cone_cutoff + let->radius / distance;
                CHECK(!(cull && faces));
                away += !faces;
                culled += cull;
            }
        }
        free(data);
    }
    CHECK(culled > away / 3);
    fprintf(stderr, "cones found %u of %u meshlets that face away\n", culled, away);
}

/* Seen from afar the cone alone decides: directions right at its limit, and random ones. A patch of
 * a torus has normals in a wide fan, so a cutoff that is a little too low fails here. */
static void meshlet_cones_from_afar(void)
{
    uint64_t state = 11;
    struct psc_mesh mesh = torus_mesh(0.5);
    uint32_t meshlets[CORNERS / 3 / 16];
    for (uint32_t i = 0; i < CORNERS / 3 / 16; i++)
        meshlets[i] = 16;
    mesh.meshlet_triangles = meshlets;
    mesh.meshlet_count = CORNERS / 3 / 16;
    struct psc_scene s;
    void *data = build_one(&mesh, &s);
    uint32_t culled = 0, kept = 0;
    for (uint32_t m = 0; m < s.meshlet_count; m++) {
        const struct psc_meshlet *let = &s.meshlets[m];
        for (int e = 0; e < 200 && let->cone_cutoff < 1; e++) {
            double v[3], length = 0, along = 0, dot = 0, worst = 1;
            for (int k = 0; k < 3; k++) {
                v[k] = uniform(&state, -1, 1);
                along += v[k] * let->cone_axis[k];
            }
            /* The part across the axis, with the part along it replaced by the limit's. */
            for (int k = 0; k < 3; k++) {
                v[k] -= along * let->cone_axis[k];
                length += v[k] * v[k];
            }
            double c = let->cone_cutoff * (e % 2 ? 1.0001 : 0.95);
            for (int k = 0; k < 3; k++) {
                v[k] = v[k] / sqrt(length) * sqrt(1 - c * c) + c * let->cone_axis[k];
                dot += v[k] * let->cone_axis[k];
            }
            for (uint32_t i = 0; i < let->index_count; i += 3) {
                const uint32_t *t = &s.indices[let->first_index + i];
                double e1[3], e2[3], n[3];
                for (int k = 0; k < 3; k++) {
                    e1[k] = (double)s.positions[t[1]][k] - s.positions[t[0]][k];
                    e2[k] = (double)s.positions[t[2]][k] - s.positions[t[0]][k];
                }
                cross(e1, e2, n);
                double size = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
                worst = fmin(worst, (n[0] * v[0] + n[1] * v[1] + n[2] * v[2]) / size);
            }
            if (dot >= let->cone_cutoff) {
                CHECK(worst >= 0);
                culled++;
            } else {
                kept += worst < 0;
            }
        }
    }
    CHECK(culled > 1000 && kept > 100); /* the limit is reached, and it is not far too strict */
    free(data);
}

int main(void)
{
    flat_normals_of_a_cube();
    watertight();
    outward();
    tangents_of_mirrored_strip();
    tangents_of_a_torus();
    meshlet_cones();
    meshlet_cones_from_afar();
    CHECK_DONE();
}
