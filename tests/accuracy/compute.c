#include "tests/accuracy/compute.h"
#include "renderer/gl/context.h"
#include "tests/unit/check.h"
#include <stdlib.h>

bool compute_begin(struct technique_ctx *ctx, struct gl_context **context)
{
    struct pen_error error = {0};
    struct pen_device_config config = {.debug = true};
    struct pen_device_info device;
    static struct technique_speed speeds[TECHNIQUE_SPEEDS];
    *context = gl_context_create(&config, &device, &error);
    if (!*context) {
        fprintf(stderr, "skipped: %s\n", error.message);
        return false;
    }
    ctx->speeds = speeds;
    ctx->programs = gl_programs_create(0, 0, NULL, NULL);
    gl_samplers_init(&ctx->samplers);
    ctx->software = device.software;
    gl_timer_init(&ctx->timer, ctx->software);
    gl.CreateVertexArrays(1, &ctx->empty_array);
    return true;
}

void compute_end(struct technique_ctx *ctx, struct gl_context *context)
{
    gl.DeleteVertexArrays(1, &ctx->empty_array);
    gl_timer_finish(&ctx->timer);
    gl_samplers_finish(&ctx->samplers);
    gl_programs_destroy(ctx->programs);
    gl_context_destroy(context);
}

void compute_run(const char *const *files, const char *main_text, uint32_t groups)
{
    const char *texts[8] = {"#version 450 core\nlayout(local_size_x = 64) in;\n"};
    char *owned[8] = {0};
    int count = 1;
    for (; files[count - 1]; count++)
        texts[count] = owned[count] = gl_program_text(files[count - 1], NULL);
    texts[count++] = main_text;
    GLuint shader = gl.CreateShader(GL_COMPUTE_SHADER), program = gl.CreateProgram();
    gl.ShaderSource(shader, count, texts, NULL);
    gl.CompileShader(shader);
    for (int i = 0; i < count; i++)
        free(owned[i]);
    gl.AttachShader(program, shader);
    gl.LinkProgram(program);
    GLint ok = 0;
    char log[2048] = "";
    gl.GetShaderInfoLog(shader, sizeof log, NULL, log);
    gl.GetProgramiv(program, GL_LINK_STATUS, &ok);
    if (!ok)
        fprintf(stderr, "%s\n", log);
    CHECK(ok);
    gl.UseProgram(program);
    gl.DispatchCompute(groups, 1, 1);
    gl.MemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
    gl.Finish();
    gl.DeleteShader(shader);
    gl.DeleteProgram(program);
}

GLuint compute_buffer(const void *data, size_t bytes, GLenum target, GLuint binding)
{
    GLuint buffer;
    gl.CreateBuffers(1, &buffer);
    gl.NamedBufferStorage(buffer, (GLsizeiptr)bytes, data, 0);
    gl.BindBufferBase(target, binding, buffer);
    return buffer;
}

double compute_random(void)
{
    return rand() / (RAND_MAX + 1.0);
}
