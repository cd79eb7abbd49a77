#include "renderer/gl/release.h"
#include "renderer/gl/program.h"
#include "renderer/gl/target.h"
#include <stdatomic.h>
#include <stdlib.h>

#define RECORDS 64           /* of drawings, that llvmpipe makes at most (lp_setup_context.h) */
#define MOST_LOOKS (1 << 18) /* a tenth of a second: should nobody open the gate */

static struct { /* there is one GL thread */
    struct gl_programs *programs;
    GLuint program, array, buffer;
    struct gl_target target;
    _Atomic uint32_t *gate;
} state;

static bool start(void)
{
    static const struct gl_program_desc desc = {
        .vertex = "screen.vert", .fragment = "release.frag"};
    const GLbitfield map =
        GL_MAP_READ_BIT | GL_MAP_WRITE_BIT | GL_MAP_PERSISTENT_BIT | GL_MAP_COHERENT_BIT;
    if (state.programs)
        return state.program && state.gate;
    state.programs = gl_programs_create(1, 0, NULL, NULL);
    state.program = gl_programs_get(state.programs, &desc, NULL);
    gl.CreateVertexArrays(1, &state.array);
    gl.CreateBuffers(1, &state.buffer);
    gl.NamedBufferStorage(state.buffer, 64, NULL, map);
    state.gate = gl.MapNamedBufferRange(state.buffer, 0, 64, map);
    struct gl_account *before = gl_textures_charge(NULL);
    gl_target_fit(&state.target, GL_RGBA8, 1, 1, 0, 1);
    gl_textures_charge(before);
    return state.program && state.gate;
}

/* The first drawing holds the rasteriser up, so that each of the others needs a record of its own. */
static void draw_all(void)
{
    gl.BindFramebuffer(GL_FRAMEBUFFER, state.target.framebuffer);
    gl.Viewport(0, 0, 1, 1);
    gl.UseProgram(state.program);
    gl.BindVertexArray(state.array);
    gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, STORAGE_COUNTS, state.buffer);
    gl.Finish();
    atomic_store(&state.gate[0], 0);
    atomic_store(&state.gate[1], MOST_LOOKS);
    for (int i = 0; i < RECORDS; i++) {
        gl.DrawArrays(GL_TRIANGLES, 0, 3);
        gl.Flush();
        if (i == RECORDS - 2) /* with one more it would wait for the first */
            atomic_store(&state.gate[0], 1);
    }
    gl.Finish();
}

void gl_release(void)
{
    static const GLenum off[] = {
        GL_BLEND, GL_CULL_FACE, GL_DEPTH_TEST, GL_SCISSOR_TEST, GL_STENCIL_TEST};
    enum { OFF = sizeof off / sizeof *off };
    GLint enabled[OFF], view[4], framebuffer, program, array, counts;
    gl_deleted_forget();
    if (!start())
        return;
    gl.GetIntegerv(GL_VIEWPORT, view);
    gl.GetIntegerv(GL_DRAW_FRAMEBUFFER_BINDING, &framebuffer);
    gl.GetIntegerv(GL_CURRENT_PROGRAM, &program);
    gl.GetIntegerv(GL_VERTEX_ARRAY_BINDING, &array);
    gl.GetIntegeri_v(GL_SHADER_STORAGE_BUFFER_BINDING, STORAGE_COUNTS, &counts);
    for (int i = 0; i < OFF; i++) {
        gl.GetIntegerv(off[i], &enabled[i]);
        gl.Disable(off[i]);
    }
    draw_all();
    for (int i = 0; i < OFF; i++)
        if (enabled[i])
            gl.Enable(off[i]);
    gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, STORAGE_COUNTS, (GLuint)counts);
    gl.BindVertexArray((GLuint)array);
    gl.UseProgram((GLuint)program);
    gl.BindFramebuffer(GL_FRAMEBUFFER, (GLuint)framebuffer);
    gl.Viewport(view[0], view[1], view[2], view[3]);
}

void gl_release_finish(void)
{
    if (!state.programs)
        return;
    gl.UnmapNamedBuffer(state.buffer);
    gl.DeleteBuffers(1, &state.buffer);
    gl.DeleteVertexArrays(1, &state.array);
    gl_target_destroy(&state.target);
    gl_programs_destroy(state.programs);
    state.programs = NULL;
    state.program = 0;
    state.gate = NULL;
}
