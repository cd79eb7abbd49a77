/* The walk of ray_bvh.glsl gives the answers of pen_bvh_occluded, ray by ray, and ends on a
 * hierarchy that would have it walk for ever. */
#include "renderer/gl/context.h"
#include "renderer/gl/gl.h"
#include "renderer/gl/program.h"
#include "renderer/trace/bvh.h"
#include "tests/unit/check.h"

enum { RAYS = 4096 };
struct ray {
    float origin[4], direction[4]; /* origin[3]: limit */
};

static uint32_t random_state = 11;

static float uniform(float low, float high)
{
    random_state = random_state * 1664525u + 1013904223u;
    return low + (high - low) * (float)(random_state >> 8) / (1 << 24);
}

static GLuint make_program(bool front_only)
{
    static const char before[] = "#version 450 core\nlayout(local_size_x = 64) in;\n";
    static const char after[] =
        "struct Ray { vec4 origin, direction; };\n"
        "layout(std430, binding = 2) readonly buffer Rays { Ray rays[]; };\n"
        "layout(std430, binding = 3) writeonly buffer Answers { uint answers[]; };\n"
        "uniform uint nodes;\n"
        "void main() {\n"
        "    Ray r = rays[gl_GlobalInvocationID.x];\n"
        "    answers[gl_GlobalInvocationID.x] =\n"
        "        uint(bvh_occluded(r.origin.xyz, r.direction.xyz, r.origin.w, nodes)) +\n"
        "        (bvh_cut ? 2u : 0u);\n"
        "}\n";
    char *walk = gl_program_text("ray_bvh.glsl", NULL);
    CHECK(walk);
    const char *texts[4] = {before, front_only ? "#define FRONT_ONLY\n" : "", walk, after};
    GLuint shader = gl.CreateShader(GL_COMPUTE_SHADER), program = gl.CreateProgram();
    gl.ShaderSource(shader, 4, texts, NULL);
    gl.CompileShader(shader);
    free(walk);
    gl.AttachShader(program, shader);
    gl.LinkProgram(program);
    GLint ok = 0;
    gl.GetProgramiv(program, GL_LINK_STATUS, &ok);
    CHECK(ok);
    return program;
}

static GLuint bind_buffer(GLuint binding, const void *data, size_t bytes)
{
    GLuint name;
    gl.CreateBuffers(1, &name);
    gl.NamedBufferData(name, bytes ? (GLsizeiptr)bytes : 16, bytes ? data : NULL, GL_STREAM_READ);
    gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, binding, name);
    return name;
}

static void walk(GLuint program, const struct pen_bvh *bvh, uint32_t nodes, const struct ray *rays,
    uint32_t answers[RAYS])
{
    GLuint buffers[4] = {bind_buffer(0, bvh->nodes, bvh->node_count * sizeof *bvh->nodes),
        bind_buffer(1, bvh->triangles, bvh->triangle_count * sizeof *bvh->triangles),
        bind_buffer(2, rays, RAYS * sizeof *rays), bind_buffer(3, answers, RAYS * 4)};
    gl.UseProgram(program);
    gl.ProgramUniform1ui(program, gl.GetUniformLocation(program, "nodes"), nodes);
    gl.DispatchCompute(RAYS / 64, 1, 1);
    gl.MemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
    gl.GetNamedBufferSubData(buffers[3], 0, RAYS * 4, answers);
    gl.DeleteBuffers(4, buffers);
}

enum shape { SOUP, FLAT, CHAIN, SHAPES };

static void make(enum shape shape, struct pen_bvh_triangle *triangles, uint32_t count)
{
    for (uint32_t i = 0; i < count; i++) {
        struct pen_bvh_triangle *t = &triangles[i];
        float scale = shape == CHAIN ? powf(0.97f, (float)i) : 1;
        *t = (struct pen_bvh_triangle){.flags = i % 3 ? 0 : PEN_BVH_TWO_SIDED};
        for (int c = 0; c < 3; c++) {
            t->corner[c] = uniform(-1, 1) * scale;
            t->edge1[c] = uniform(-0.3f, 0.3f) * scale;
            t->edge2[c] = uniform(-0.3f, 0.3f) * scale;
        }
        if (shape == FLAT)
            t->corner[1] = t->edge1[1] = t->edge2[1] = 0;
    }
}

static void make_rays(struct ray rays[RAYS])
{
    for (int i = 0; i < RAYS; i++) {
        for (int c = 0; c < 3; c++) {
            rays[i].origin[c] = uniform(-1.5f, 1.5f);
            rays[i].direction[c] = uniform(-1.5f, 1.5f) - rays[i].origin[c];
        }
        rays[i].origin[3] = i % 2 ? 1 : 1e30f;
        if (i % 8 == 0) /* along an axis: infinite inverses */
            rays[i].direction[i / 8 % 3] = rays[i].direction[(i / 8 + 1) % 3] = 0;
    }
}

static void check_shape(GLuint program, bool front_only, enum shape shape, uint32_t count)
{
    static struct pen_bvh_triangle triangles[3000];
    static struct ray rays[RAYS];
    static uint32_t answers[RAYS];
    struct pen_bvh bvh;
    uint32_t hits = 0, wrong = 0;
    make(shape, triangles, count);
    make_rays(rays);
    CHECK(pen_bvh_build(triangles, count, &bvh, NULL));
    walk(program, &bvh, count ? bvh.node_count : 0, rays, answers);
    for (int i = 0; i < RAYS; i++) {
        bool hit = pen_bvh_occluded(
            &bvh, front_only, rays[i].origin, rays[i].direction, rays[i].origin[3]);
        hits += hit;
        wrong += answers[i] != hit;
    }
    printf("shape %d, %u triangles, depth %u: %u of %d rays hit, %u differ\n", shape, count,
        bvh.depth, hits, RAYS, wrong);
    /* Rounding may decide a ray that grazes an edge either way where products are fused. */
    CHECK(wrong * 1000 <= RAYS);
    CHECK(count < 64 || (hits > RAYS / 50 && hits < RAYS));
    pen_bvh_finish(&bvh);
}

/* An inner node that is its own child, under a box that every ray meets. */
static void check_endless(GLuint program)
{
    static struct ray rays[RAYS];
    static uint32_t answers[RAYS];
    struct pen_bvh_node nodes[2] = {
        {{-9, -9, -9}, 0, {9, 9, 9}, 0}, {{-9, -9, -9}, 0, {9, 9, 9}, 0}};
    struct pen_bvh_triangle triangle = {.first_index = 0};
    struct pen_bvh bvh = {.nodes = nodes, .triangles = &triangle, 2, 1, 0, 0};
    make_rays(rays);
    memset(answers, 255, sizeof answers);
    walk(program, &bvh, 2, rays, answers);
    for (int i = 0; i < RAYS; i++)
        CHECK(answers[i] == 2); /* cut, and said so */
}

int main(void)
{
    struct pen_device_config config = {.debug = true};
    struct pen_device_info device;
    struct pen_error error = {0};
    struct gl_context *context = gl_context_create(&config, &device, &error);
    if (!context) {
        fprintf(stderr, "skipped: %s\n", error.message);
        return 77;
    }
    static const uint32_t counts[] = {0, 1, 5, 64, 3000};
    for (int front_only = 0; front_only < 2; front_only++) {
        GLuint program = make_program(front_only);
        for (enum shape shape = SOUP; shape < SHAPES; shape++)
            for (size_t k = 0; k < sizeof counts / sizeof *counts; k++)
                check_shape(program, front_only, shape, counts[k]);
        check_endless(program);
        gl.DeleteProgram(program);
    }
    CHECK(gl.GetError() == GL_NO_ERROR);
    gl_context_destroy(context);
    CHECK_DONE();
}
