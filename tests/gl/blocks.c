/* Every block of the shaders lies in C where the driver says that it lies: members, strides of
 * arrays, structures in them, and the binding. */
#include "renderer/gl/context.h"
#include "renderer/gl/program.h"
#include "tests/gl/blocks.h"
#include "tests/unit/check.h"

struct member {
    const char *name, *type; /* type: of an array of structures, else NULL */
    size_t offset, stride;   /* stride 0: no array */
};

static struct group {
    const char *name;
    size_t size;
    struct member members[32];
    uint32_t count;
} structures[64], *open;
static uint32_t structure_count, compared;

static struct group block;
static GLenum block_kind;
static int block_binding;
static GLuint program;

void layout_structure(const char *name, size_t size)
{
    open = &structures[structure_count++];
    *open = (struct group){.name = name, .size = size};
}

void layout_block(GLenum kind, const char *name, int binding, size_t size)
{
    open = &block;
    block = (struct group){.name = name, .size = size};
    block_kind = kind;
    block_binding = binding;
}

void layout_field(const char *name, size_t offset, size_t stride)
{
    open->members[open->count++] = (struct member){name, NULL, offset, stride};
}

void layout_array(const char *name, const char *type, size_t offset, size_t stride)
{
    open->members[open->count++] = (struct member){name, type, offset, stride};
}

static const struct group *structure_of(const char *name)
{
    for (uint32_t i = 0; i < structure_count; i++)
        if (!strcmp(structures[i].name, name))
            return &structures[i];
    return NULL;
}

static GLint property(GLenum interface, const char *name, GLenum property)
{
    GLuint index = gl.GetProgramResourceIndex(program, interface, name);
    GLint value = -1;
    if (index != GL_INVALID_INDEX)
        gl.GetProgramResourceiv(program, interface, index, 1, &property, 1, NULL, &value);
    return value;
}

static void expect(GLenum interface, const char *name, GLenum what, size_t expected)
{
    GLint found = property(interface, name, what);
    if (found != (GLint)expected)
        fprintf(stderr, "%s: %d in the driver, %zu in C\n", name, found, expected);
    CHECK(found == (GLint)expected);
    compared++;
}

static void expect_member(const char *prefix, const struct member *m, size_t base)
{
    bool uniform = block_kind == GL_UNIFORM_BLOCK;
    GLenum interface = uniform ? GL_UNIFORM : GL_BUFFER_VARIABLE;
    char name[128];
    snprintf(name, sizeof name, "%s%s%s", prefix, m->name, m->stride ? "[0]" : "");
    expect(interface, name, GL_OFFSET, base + m->offset);
    if (m->stride)
        expect(interface, name, GL_ARRAY_STRIDE, m->stride);
}

/* An array of structures, or of any length. */
static void expect_array(const char *prefix, const struct member *m)
{
    const struct group *s = structure_of(m->type);
    char name[160];
    for (uint32_t i = 0; s && i < s->count; i++) {
        snprintf(name, sizeof name, "%s%s[0].", prefix, m->name);
        expect_member(name, &s->members[i], m->offset);
        if (block_kind == GL_UNIFORM_BLOCK) {
            snprintf(name, sizeof name, "%s%s[1].", prefix, m->name);
            expect_member(name, &s->members[i], m->offset + m->stride);
        }
    }
    if (block_kind != GL_SHADER_STORAGE_BLOCK)
        return;
    size_t stride = s ? s->size : !strcmp(m->type, "ivec2") ? 8 : 4;
    snprintf(name, sizeof name, "%s%s[0]%s%s", prefix, m->name, s ? "." : "",
        s ? s->members[0].name : "");
    if (s && s->members[0].stride)
        strcat(name, "[0]");
    expect(GL_BUFFER_VARIABLE, name, s ? GL_TOP_LEVEL_ARRAY_STRIDE : GL_ARRAY_STRIDE, stride);
}

void layout_end(const char *instance)
{
    char prefix[64] = "";
    if (*instance)
        snprintf(prefix, sizeof prefix, "%s.", block.name);
    expect(block_kind, block.name, GL_BUFFER_BINDING, (size_t)block_binding);
    if (block_kind == GL_UNIFORM_BLOCK)
        CHECK(property(block_kind, block.name, GL_BUFFER_DATA_SIZE) <= (GLint)block.size);
    for (uint32_t i = 0; i < block.count; i++)
        if (block.members[i].type)
            expect_array(prefix, &block.members[i]);
        else
            expect_member(prefix, &block.members[i], 0);
}

bool layout_begin(const char *file)
{
    static const char before[] = "#version 450 core\nlayout(local_size_x = 1) in;\n";
    char log[1024] = "", *text = gl_program_text(file, NULL);
    const char *texts[3] = {before, text, "void main() {}\n"};
    GLuint shader = gl.CreateShader(GL_COMPUTE_SHADER);
    GLint ok = 0;
    CHECK(text);
    gl.ShaderSource(shader, 3, texts, NULL);
    gl.CompileShader(shader);
    program = gl.CreateProgram();
    gl.AttachShader(program, shader);
    gl.LinkProgram(program);
    gl.GetProgramiv(program, GL_LINK_STATUS, &ok);
    gl.GetShaderInfoLog(shader, sizeof log, NULL, log);
    if (!ok)
        fprintf(stderr, "%s: %s\n", file, log);
    CHECK(ok);
    gl.DeleteShader(shader);
    free(text);
    return ok;
}

void layout_finish(void)
{
    gl.DeleteProgram(program);
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
    layout_all();
    printf("%u places and strides\n", compared);
    CHECK(compared);
    CHECK(gl.GetError() == GL_NO_ERROR);
    gl_context_destroy(context);
    CHECK_DONE();
}
