#include "renderer/gl/program.h"
#include "renderer/gl/source.h"
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct text {
    char *data;
    size_t size;
};

struct entry {
    uint64_t hash;
    char *key; /* all stages' sources, one after the other */
    GLuint program;
};

struct gl_programs {
    struct entry *entries;
    uint32_t count, room;
};

static void append_n(struct text *t, const char *data, size_t size)
{
    char *grown = realloc(t->data, t->size + size + 1);
    if (!grown)
        abort();
    memcpy(grown + t->size, data, size);
    t->data = grown;
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

static const char *find_source(const char *name)
{
    for (const struct gl_source *s = gl_sources; s->name; s++)
        if (!strcmp(s->name, name))
            return s->text;
    return NULL;
}

#define MAX_INCLUDES 32

struct expansion {
    struct text *out;
    const char *body;
    const char *seen[MAX_INCLUDES];
    uint32_t seen_count;
};

static bool expand(struct expansion *e, const char *name, struct pen_error *error)
{
    static const char directive[] = "#include \"";
    if (!strcmp(name, "BODY"))
        name = e->body ? e->body : "";
    const char *text = find_source(name);
    if (!text)
        return pen_fail(error, PEN_INTERNAL, "", "The shader file \"%s\" does not exist.", name);
    for (uint32_t i = 0; i < e->seen_count; i++)
        if (e->seen[i] == text)
            return true;
    if (e->seen_count == MAX_INCLUDES)
        return pen_fail(error, PEN_INTERNAL, "", "Too many shader files are included.");
    e->seen[e->seen_count++] = text;
    for (const char *line = text; *line;) {
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

/* The rows as GLSL: P(name) reads a member of the uniform block or a constant. A flag is a bool. */
static void append_params(struct text *t, const struct pen_technique_info *info, const void *params)
{
    append(t, "#define P(name) P_##name\n");
    if (info->params.count) {
        append(t, "layout(std140, binding = 2) uniform ParamBlock {\n");
        static const char *const types[] = {"float", "int", "uint", "uint"};
        for (uint32_t i = 0; i < info->params.count; i++)
            appendf(
                t, "    %s p_%s;\n", types[info->params.rows[i].type], info->params.rows[i].name);
        append(t, "} param_block;\n");
    }
    for (uint32_t i = 0; i < info->params.count; i++) {
        const struct pen_param *row = &info->params.rows[i];
        if (row->specialise && row->type == PEN_PARAM_FLOAT)
            appendf(t, "#define P_%s float(%.9g)\n", row->name, pen_param_load(row, params, 0));
        else if (row->specialise && row->type == PEN_PARAM_FLAG)
            appendf(t, "#define P_%s %s\n", row->name,
                pen_param_load(row, params, 0) != 0 ? "true" : "false");
        else if (row->specialise)
            appendf(t, "#define P_%s %.0f\n", row->name, pen_param_load(row, params, 0));
        else if (row->type == PEN_PARAM_FLAG)
            appendf(t, "#define P_%s (param_block.p_%s != 0u)\n", row->name, row->name);
        else
            appendf(t, "#define P_%s param_block.p_%s\n", row->name, row->name);
        if (row->choices)
            for (uint32_t k = 0; row->choices[k]; k++) {
                char constant[96];
                snprintf(constant, sizeof constant, "%s_%s", row->name, row->choices[k]);
                for (char *c = constant; *c; c++)
                    *c = *c == '-' ? '_' : (char)(*c >= 'a' && *c <= 'z' ? *c - 32 : *c);
                appendf(t, "#define %s %uu\n", constant, k);
            }
    }
}

static bool assemble(
    const struct gl_program_desc *desc, const char *file, struct text *out, struct pen_error *error)
{
    append(out, "#version 450 core\n");
    if (desc->defines)
        append(out, desc->defines);
    if (desc->info)
        append_params(out, desc->info, desc->params);
    struct expansion e = {.out = out, .body = desc->body};
    return expand(&e, file, error);
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

static uint64_t hash_of(const char *text, size_t size)
{
    uint64_t h = 0xcbf29ce484222325u; /* FNV-1a */
    for (size_t i = 0; i < size; i++)
        h = (h ^ (unsigned char)text[i]) * 0x100000001b3u;
    return h;
}

GLuint gl_programs_get(
    struct gl_programs *programs, const struct gl_program_desc *desc, struct pen_error *error)
{
    const char *files[3] = {desc->vertex, desc->fragment, desc->compute};
    static const GLenum stages[3] = {GL_VERTEX_SHADER, GL_FRAGMENT_SHADER, GL_COMPUTE_SHADER};
    struct text sources[3] = {0}, key = {0};
    GLuint shaders[3] = {0}, program = 0;
    for (int i = 0; i < 3; i++)
        if (files[i]) {
            if (!assemble(desc, files[i], &sources[i], error))
                goto done;
            append_n(&key, sources[i].data, sources[i].size);
        }
    uint64_t hash = hash_of(key.data, key.size);
    for (uint32_t i = 0; i < programs->count; i++)
        if (programs->entries[i].hash == hash && !strcmp(programs->entries[i].key, key.data)) {
            program = programs->entries[i].program;
            goto done;
        }
    for (int i = 0; i < 3; i++)
        if (files[i] && !(shaders[i] = compile(stages[i], sources[i].data, files[i], error)))
            goto done;
    program = gl.CreateProgram();
    for (int i = 0; i < 3; i++)
        if (shaders[i])
            gl.AttachShader(program, shaders[i]);
    gl.LinkProgram(program);
    GLint ok = 0;
    gl.GetProgramiv(program, GL_LINK_STATUS, &ok);
    if (!ok) {
        char log[4096];
        gl.GetProgramInfoLog(program, sizeof log, NULL, log);
        fprintf(stderr, "link: %s\n", log);
        gl.DeleteProgram(program);
        program = 0;
        pen_fail(error, PEN_INTERNAL, "", "A shader program does not link on this device.");
        goto done;
    }
    if (programs->count == programs->room) {
        programs->room = programs->room ? 2 * programs->room : 32;
        programs->entries = realloc(programs->entries, programs->room * sizeof *programs->entries);
        if (!programs->entries)
            abort();
    }
    programs->entries[programs->count++] = (struct entry){hash, key.data, program};
    key.data = NULL;
done:
    for (int i = 0; i < 3; i++) {
        if (shaders[i])
            gl.DeleteShader(shaders[i]);
        free(sources[i].data);
    }
    free(key.data);
    return program;
}

struct gl_programs *gl_programs_create(void)
{
    struct gl_programs *programs = calloc(1, sizeof *programs);
    if (!programs)
        abort();
    return programs;
}

void gl_programs_destroy(struct gl_programs *programs)
{
    if (!programs)
        return;
    for (uint32_t i = 0; i < programs->count; i++) {
        gl.DeleteProgram(programs->entries[i].program);
        free(programs->entries[i].key);
    }
    free(programs->entries);
    free(programs);
}
