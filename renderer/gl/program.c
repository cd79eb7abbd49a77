#include "renderer/gl/program.h"
#include "protocol/fnv.h"
#include "protocol/memory.h"
#include "renderer/gl/source.h"
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define MOST_PROGRAMS 256
#define MOST_BYTES (512ull << 20)
/* An estimate. No driver says what a program takes, and GL_PROGRAM_BINARY_LENGTH writes the whole
 * binary to say how long that is. Measured with llvmpipe, whose machine code lies in the process:
 * the resident memory of all methods' programs over the length of their texts. */
#define PROGRAM_BYTES_PER_CHARACTER 140

struct text {
    char *data;
    size_t size, room;
};

/* All that a program's text is made from, without that text. */
#define MAX_KEY 2048
struct key {
    uint64_t hash;
    uint32_t size;
    unsigned char bytes[MAX_KEY];
};

struct entry {
    uint64_t hash, last_use, bytes;
    unsigned char *key;
    uint32_t key_size;
    GLuint program;
};

struct gl_programs {
    uint32_t most;
    uint64_t most_bytes;
    bool (*make_room)(void *owner, uint64_t bytes);
    void *owner;
    struct pen_program_counts counts;
    struct entry *entries; /* counts.kept of them */
    size_t room;
    uint64_t clock; /* frames */
};

static void append_n(struct text *t, const char *data, size_t size)
{
    t->data = pen_grow(t->data, &t->room, t->size + size + 1, 1);
    memcpy(t->data + t->size, data, size);
    t->size += size;
    t->data[t->size] = 0;
}

static void append(struct text *t, const char *s)
{
    append_n(t, s, strlen(s));
}

__attribute__((format(printf, 2, 3))) static void appendf(struct text *t, const char *format, ...)
{
    char line[256];
    va_list args;
    va_start(args, format);
    vsnprintf(line, sizeof line, format, args);
    va_end(args);
    append(t, line);
}

static const struct gl_source *find_source(const char *name)
{
    for (const struct gl_source *s = gl_sources; s->name; s++)
        if (!strcmp(s->name, name))
            return s;
    return NULL;
}

#define MAX_INCLUDES 64

struct expansion {
    struct text *out;
    const char *body;
    const struct gl_source *seen[MAX_INCLUDES];
    uint32_t seen_count;
};

static bool expand(struct expansion *e, const char *name, struct pen_error *error)
{
    static const char directive[] = "#include \"";
    if (!strcmp(name, "BODY"))
        name = e->body ? e->body : "";
    const struct gl_source *source = find_source(name);
    if (!source)
        return pen_fail(error, PEN_INTERNAL, "", "The shader file \"%s\" does not exist.", name);
    for (uint32_t i = 0; i < e->seen_count; i++)
        if (e->seen[i] == source)
            return true;
    if (e->seen_count == MAX_INCLUDES)
        return pen_fail(error, PEN_INTERNAL, "", "Too many shader files are included.");
    e->seen[e->seen_count++] = source;
    for (const struct gl_constant *c = source->constants; c && c->name; c++)
        appendf(e->out, "#define %s %d%s\n", c->name, c->value, c->is_unsigned ? "u" : "");
    for (const char *line = source->text; *line;) {
        const char *end = strchrnul(line, '\n');
        if (!strncmp(line, directive, sizeof directive - 1)) {
            char included[64];
            const char *from = line + sizeof directive - 1;
            size_t length = strcspn(from, "\"");
            if (length >= sizeof included)
                return pen_fail(error, PEN_INTERNAL, "", "A shader file name is too long.");
            memcpy(included, from, length);
            included[length] = 0;
            if (!expand(e, included, error))
                return false;
        } else {
            append_n(e->out, line, (size_t)(end - line));
            append(e->out, "\n");
        }
        line = *end ? end + 1 : end;
    }
    return true;
}

/* The constant that stands for a row's value. */
static void append_constant(struct text *t, const struct pen_param *row, double value)
{
    switch (row->type) {
    case PEN_PARAM_FLOAT:
        appendf(t, "float(%.9g)", value);
        break;
    case PEN_PARAM_INT:
        appendf(t, "int(%.0f)", value);
        break;
    case PEN_PARAM_UINT:
        appendf(t, "%.0fu", value);
        break;
    default:
        append(t, value != 0 ? "true" : "false");
        break;
    }
}

/* An enumeration's names as constants: MODE_PAPER. */
static void append_choices(struct text *t, const struct pen_param *row)
{
    for (uint32_t k = 0; row->choices && row->choices[k]; k++) {
        char constant[96];
        snprintf(constant, sizeof constant, "%s_%s", row->name, row->choices[k]);
        for (char *c = constant; *c; c++)
            *c = *c == '-' ? '_' : (char)(*c >= 'a' && *c <= 'z' ? *c - 32 : *c);
        appendf(t, "#define %s %uu\n", constant, k);
    }
}

/* The rows as GLSL: P(name) reads a member of the uniform block or a constant, and has the type of
 * the row either way: float, int, uint or, for a flag, bool. */
static void append_params(struct text *t, const struct pen_technique_info *info, const void *params)
{
    static const char *const types[] = {"float", "int", "uint", "uint"};
    append(t, "#define P(name) P_##name\n");
    if (info->params.count) {
        append(t, "layout(std140, binding = UBO_PARAMS) uniform ParamBlock {\n");
        for (uint32_t i = 0; i < info->params.count; i++)
            appendf(
                t, "    %s p_%s;\n", types[info->params.rows[i].type], info->params.rows[i].name);
        append(t, "} param_block;\n");
    }
    for (uint32_t i = 0; i < info->params.count; i++) {
        const struct pen_param *row = &info->params.rows[i];
        appendf(t, "#define P_%s ", row->name);
        if (row->specialise)
            append_constant(t, row, pen_param_load(row, params, 0));
        else if (row->type == PEN_PARAM_FLAG)
            appendf(t, "(param_block.p_%s != 0u)", row->name);
        else
            appendf(t, "param_block.p_%s", row->name);
        append(t, "\n");
        append_choices(t, row);
    }
}

static bool assemble(
    const struct gl_program_desc *desc, const char *file, struct text *out, struct pen_error *error)
{
    struct expansion e = {.out = out, .body = desc->body};
    append(out, "#version 450 core\n");
    if (!expand(&e, "bindings.def", error))
        return false;
    if (desc->defines)
        append(out, desc->defines);
    if (desc->info)
        append_params(out, desc->info, desc->params);
    return expand(&e, file, error);
}

char *gl_program_text(const char *file, struct pen_error *error)
{
    struct text out = {0};
    struct expansion e = {.out = &out};
    if (expand(&e, "bindings.def", error) && expand(&e, file, error))
        return out.data;
    free(out.data);
    return NULL;
}

/* The lines around the first one that the compiler's log names, as "0:LINE(". */
static void print_around(const char *text, const char *log)
{
    const char *colon = strchr(log, ':');
    int wanted = colon ? atoi(colon + 1) : 0, number = 1;
    for (const char *line = text; *line; number++) {
        const char *end = strchrnul(line, '\n');
        if (abs(number - wanted) <= 3)
            fprintf(stderr, "%4d %.*s\n", number, (int)(end - line), line);
        line = *end ? end + 1 : end;
    }
}

static GLuint compile(GLenum stage, const char *text, const char *file, struct pen_error *error)
{
    GLuint shader = gl.CreateShader(stage);
    gl.ShaderSource(shader, 1, &text, NULL);
    gl.CompileShader(shader);
    GLint ok = 0;
    gl.GetShaderiv(shader, GL_COMPILE_STATUS, &ok);
    if (ok)
        return shader;
    char log[4096];
    gl.GetShaderInfoLog(shader, sizeof log, NULL, log);
    print_around(text, log);
    fprintf(stderr, "%s: %s\n", file, log);
    gl.DeleteShader(shader);
    pen_fail(error, PEN_INTERNAL, "", "The shader %s does not compile on this device.", file);
    return 0;
}

static void key_add(struct key *key, const void *data, size_t size)
{
    if (size <= MAX_KEY - key->size)
        memcpy(key->bytes + key->size, data, size);
    key->size = size <= MAX_KEY - key->size ? key->size + (uint32_t)size : MAX_KEY;
}

static void key_add_string(struct key *key, const char *s)
{
    key_add(key, s ? s : "", s ? strlen(s) + 1 : 1);
}

/* Names of files, defines, what the rows are called and how they are read, and of those that
 * specialise the value: whatever else could change the text is the same for the whole process. */
static bool make_key(const struct gl_program_desc *desc, struct key *key, struct pen_error *error)
{
    key->size = 0;
    key_add_string(key, desc->vertex);
    key_add_string(key, desc->fragment);
    key_add_string(key, desc->compute);
    key_add_string(key, desc->body);
    key_add_string(key, desc->defines);
    for (uint32_t i = 0; desc->info && i < desc->info->params.count; i++) {
        const struct pen_param *row = &desc->info->params.rows[i];
        const uint8_t kind[2] = {row->type, row->specialise};
        key_add_string(key, row->name);
        key_add(key, kind, sizeof kind);
        if (row->specialise)
            key_add(key, (const char *)desc->params + row->offset, 4);
    }
    if (key->size == MAX_KEY)
        return pen_fail(error, PEN_INTERNAL, "", "What a program is made of is too long.");
    key->hash = pen_fnv(PEN_FNV_START, key->bytes, key->size);
    return true;
}

static struct entry *find(struct gl_programs *programs, const struct key *key)
{
    for (uint32_t i = 0; i < programs->counts.kept; i++) {
        struct entry *e = &programs->entries[i];
        if (e->hash == key->hash && e->key_size == key->size &&
            !memcmp(e->key, key->bytes, key->size))
            return e;
    }
    return NULL;
}

static GLuint link(const GLuint shaders[3], struct pen_error *error)
{
    GLuint program = gl.CreateProgram();
    for (int i = 0; i < 3; i++)
        if (shaders[i])
            gl.AttachShader(program, shaders[i]);
    gl.LinkProgram(program);
    GLint ok = 0;
    gl.GetProgramiv(program, GL_LINK_STATUS, &ok);
    if (ok)
        return program;
    char log[4096];
    gl.GetProgramInfoLog(program, sizeof log, NULL, log);
    fprintf(stderr, "link: %s\n", log);
    gl.DeleteProgram(program);
    pen_fail(error, PEN_INTERNAL, "", "A shader program does not link on this device.");
    return 0;
}

/* *bytes: of the texts. */
static GLuint build(const struct gl_program_desc *desc, uint64_t *bytes, struct pen_error *error)
{
    static const GLenum stages[3] = {GL_VERTEX_SHADER, GL_FRAGMENT_SHADER, GL_COMPUTE_SHADER};
    const char *files[3] = {desc->vertex, desc->fragment, desc->compute};
    GLuint shaders[3] = {0};
    bool ok = true;
    *bytes = 0;
    for (int i = 0; ok && i < 3; i++) {
        struct text source = {0};
        if (!files[i])
            continue;
        ok = assemble(desc, files[i], &source, error) &&
             (shaders[i] = compile(stages[i], source.data, files[i], error)) != 0;
        *bytes += source.size;
        free(source.data);
    }
    GLuint program = ok ? link(shaders, error) : 0;
    for (int i = 0; i < 3; i++)
        if (shaders[i])
            gl.DeleteShader(shaders[i]);
    return program;
}

static void keep(struct gl_programs *programs, const struct key *key, GLuint program, uint64_t text)
{
    struct pen_program_counts *counts = &programs->counts;
    programs->entries =
        pen_grow(programs->entries, &programs->room, counts->kept + 1, sizeof *programs->entries);
    unsigned char *copy = pen_alloc(key->size, 1);
    memcpy(copy, key->bytes, key->size);
    struct entry *e = &programs->entries[counts->kept++];
    *e = (struct entry){.hash = key->hash,
        .last_use = programs->clock,
        .bytes = PROGRAM_BYTES_PER_CHARACTER * text,
        .key = copy,
        .key_size = key->size,
        .program = program};
    counts->bytes += e->bytes;
    counts->compiled++;
    if (programs->make_room)
        programs->make_room(programs->owner, 0);
}

GLuint gl_programs_get(
    struct gl_programs *programs, const struct gl_program_desc *desc, struct pen_error *error)
{
    struct key key;
    if (!make_key(desc, &key, error))
        return 0;
    struct entry *known = find(programs, &key);
    if (known) {
        known->last_use = programs->clock;
        return known->program;
    }
    uint64_t text;
    GLuint program = build(desc, &text, error);
    if (program)
        keep(programs, &key, program, text);
    return program;
}

static void drop(struct gl_programs *programs, uint32_t i)
{
    struct entry *e = &programs->entries[i];
    gl.DeleteProgram(e->program);
    free(e->key);
    programs->counts.bytes -= e->bytes;
    *e = programs->entries[--programs->counts.kept];
}

uint64_t gl_programs_clock(const struct gl_programs *programs)
{
    return programs->clock;
}

void gl_programs_end_frame(struct gl_programs *programs, uint64_t since)
{
    struct pen_program_counts *counts = &programs->counts;
    while (counts->kept > programs->most || counts->bytes > programs->most_bytes) {
        uint32_t oldest = 0;
        for (uint32_t i = 1; i < counts->kept; i++)
            if (programs->entries[i].last_use < programs->entries[oldest].last_use)
                oldest = i;
        if (programs->entries[oldest].last_use >= since)
            break;
        drop(programs, oldest);
        counts->evicted++;
    }
    programs->clock++;
}

struct pen_program_counts gl_programs_counts(const struct gl_programs *programs)
{
    return programs->counts;
}

struct gl_programs *gl_programs_create(
    uint32_t most, uint64_t most_bytes, bool (*make_room)(void *owner, uint64_t bytes), void *owner)
{
    struct gl_programs *programs = pen_alloc_zero(1, sizeof *programs);
    programs->most = most ? most : MOST_PROGRAMS;
    programs->most_bytes = most_bytes ? most_bytes : MOST_BYTES;
    programs->make_room = make_room;
    programs->owner = owner;
    return programs;
}

void gl_programs_destroy(struct gl_programs *programs)
{
    if (!programs)
        return;
    while (programs->counts.kept)
        drop(programs, programs->counts.kept - 1);
    free(programs->entries);
    free(programs);
}
