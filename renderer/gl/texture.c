#include "renderer/gl/texture.h"
#include <assert.h>
#include <string.h>

static struct gl_account *charged;
static uint64_t deleted; /* there is one GL thread */
static struct gl_texture spares[16];
#define SPARES (sizeof spares / sizeof *spares)

struct gl_account *gl_textures_charge(struct gl_account *account)
{
    struct gl_account *before = charged;
    charged = account;
    return before;
}

bool gl_textures_make_room(uint64_t bytes)
{
    return !charged || !charged->make_room || charged->make_room(charged->owner, bytes);
}

void gl_deleted_add(uint64_t bytes)
{
    deleted += bytes;
}

uint64_t gl_deleted_bytes(void)
{
    return deleted;
}

void gl_deleted_forget(void)
{
    deleted = 0;
}

void gl_textures_count(struct gl_texture *memory, uint64_t bytes)
{
    *memory = (struct gl_texture){.bytes = bytes, .account = charged};
    if (charged)
        charged->bytes += bytes;
}

void gl_texture_release_account(struct gl_texture *texture)
{
    if (texture->account)
        texture->account->bytes -= texture->bytes;
    texture->account = NULL;
}

static bool charge(struct gl_texture *texture)
{
    if (!gl_textures_make_room(texture->bytes))
        return false;
    texture->account = charged;
    if (charged)
        charged->bytes += texture->bytes;
    return true;
}

static uint32_t texel_bytes(GLenum format)
{
    switch (format) {
    case GL_R8:
    case GL_R8UI:
        return 1;
    case GL_RG8:
    case GL_R16F:
    case GL_R16UI:
        return 2;
    case GL_RG32F:
    case GL_RG32UI:
    case GL_RGBA16F:
    case GL_RGBA16:
    case GL_RGBA16UI:
        return 8;
    case GL_RGBA32F:
    case GL_RGBA32UI:
        return 16;
    default:
        return 4;
    }
}

/* A spare one of that shape; false: there is none. */
static bool take_spare(struct gl_texture *t)
{
    for (size_t i = 0; i < SPARES; i++) {
        struct gl_texture *s = &spares[i];
        if (!s->name || s->target != t->target || s->format != t->format || s->width != t->width ||
            s->height != t->height || s->layers != t->layers || s->levels != t->levels)
            continue;
        t->name = s->name;
        s->name = 0;
        return true;
    }
    return false;
}

struct gl_texture gl_texture_create(
    GLenum format, uint32_t width, uint32_t height, uint32_t layers, uint32_t levels)
{
    uint32_t side = width > height ? width : height, chain = 1;
    while (side >> chain)
        chain++;
    struct gl_texture t = {.target = layers ? GL_TEXTURE_2D_ARRAY : GL_TEXTURE_2D,
        .format = format,
        .width = width,
        .height = height,
        .layers = layers,
        .levels = levels && levels < chain ? levels : chain};
    for (uint32_t l = 0; l < t.levels; l++) {
        uint64_t lw = width >> l ? width >> l : 1, lh = height >> l ? height >> l : 1;
        t.bytes += lw * lh * (layers ? layers : 1) * texel_bytes(format);
    }
    if (!charge(&t)) {
        t.width = t.height = width = height = t.levels = 1;
        t.layers = layers = layers ? 1 : 0;
        t.bytes = texel_bytes(format);
    }
    if (take_spare(&t))
        return t;
    gl.CreateTextures(t.target, 1, &t.name);
    GLsizei n = (GLsizei)t.levels, w = (GLsizei)width, h = (GLsizei)height;
    if (layers)
        gl.TextureStorage3D(t.name, n, format, w, h, (GLsizei)layers);
    else
        gl.TextureStorage2D(t.name, n, format, w, h);
    gl.TextureParameteri(
        t.name, GL_TEXTURE_MIN_FILTER, t.levels > 1 ? GL_NEAREST_MIPMAP_NEAREST : GL_NEAREST);
    gl.TextureParameteri(t.name, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    gl.TextureParameteri(t.name, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    gl.TextureParameteri(t.name, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    return t;
}

struct gl_texture gl_texture_create_samples(
    GLenum format, uint32_t width, uint32_t height, uint32_t samples)
{
    struct gl_texture t = {.target = GL_TEXTURE_2D_MULTISAMPLE,
        .format = format,
        .width = width,
        .height = height,
        .levels = 1,
        .bytes = (uint64_t)width * height * samples * texel_bytes(format)};
    if (!charge(&t)) {
        t.width = t.height = width = height = 1;
        t.bytes = (uint64_t)samples * texel_bytes(format);
    }
    gl.CreateTextures(t.target, 1, &t.name);
    gl.TextureStorage2DMultisample(
        t.name, (GLsizei)samples, format, (GLsizei)width, (GLsizei)height, GL_TRUE);
    return t;
}

void gl_texture_destroy(struct gl_texture *texture)
{
    if (!texture)
        return;
    gl_texture_release_account(texture);
    if (texture->name) {
        gl.DeleteTextures(1, &texture->name);
        gl_deleted_add(texture->bytes);
    }
    memset(texture, 0, sizeof *texture);
}

void gl_texture_recycle(struct gl_texture *texture)
{
    for (size_t i = 0; i < SPARES && texture->name; i++) {
        if (spares[i].name)
            continue;
        gl_texture_release_account(texture);
        spares[i] = *texture;
        texture->name = 0;
    }
    gl_texture_destroy(texture);
}

void gl_textures_forget(void)
{
    for (size_t i = 0; i < SPARES; i++)
        gl_texture_destroy(&spares[i]);
}

GLuint gl_framebuffer_create(
    const struct gl_texture *const *colors, uint32_t count, const struct gl_texture *depth)
{
    GLuint name;
    GLenum buffers[8];
    assert(count <= 8);
    gl.CreateFramebuffers(1, &name);
    for (uint32_t i = 0; i < count; i++) {
        buffers[i] = GL_COLOR_ATTACHMENT0 + i;
        gl.NamedFramebufferTexture(name, buffers[i], colors[i]->name, 0);
    }
    gl.NamedFramebufferDrawBuffers(name, (GLsizei)count, buffers);
    if (!count)
        gl.NamedFramebufferReadBuffer(name, GL_NONE);
    if (depth)
        gl.NamedFramebufferTexture(name, GL_DEPTH_ATTACHMENT, depth->name, 0);
    return name;
}

void gl_samplers_init(struct gl_samplers *samplers)
{
    static const struct {
        GLint min, mag, wrap, compare;
    } kinds[GL_SAMPLER_KINDS] = {
        [GL_SAMPLE_NEAREST] = {GL_NEAREST, GL_NEAREST, GL_CLAMP_TO_EDGE, 0},
        [GL_SAMPLE_LINEAR] = {GL_LINEAR, GL_LINEAR, GL_CLAMP_TO_EDGE, 0},
        [GL_SAMPLE_TRILINEAR] = {GL_LINEAR_MIPMAP_LINEAR, GL_LINEAR, GL_CLAMP_TO_EDGE, 0},
        [GL_SAMPLE_NEAREST_BORDER] = {GL_NEAREST, GL_NEAREST, GL_CLAMP_TO_BORDER, 0},
        [GL_SAMPLE_COMPARE_NEAREST] = {GL_NEAREST, GL_NEAREST, GL_CLAMP_TO_BORDER, 1},
        [GL_SAMPLE_COMPARE_LINEAR] = {GL_LINEAR, GL_LINEAR, GL_CLAMP_TO_BORDER, 1},
    };
    static const float border[4] = {1, 1, 1, 1};
    gl.CreateSamplers(GL_SAMPLER_KINDS, samplers->names);
    for (int i = 0; i < GL_SAMPLER_KINDS; i++) {
        GLuint s = samplers->names[i];
        gl.SamplerParameteri(s, GL_TEXTURE_MIN_FILTER, kinds[i].min);
        gl.SamplerParameteri(s, GL_TEXTURE_MAG_FILTER, kinds[i].mag);
        gl.SamplerParameteri(s, GL_TEXTURE_WRAP_S, kinds[i].wrap);
        gl.SamplerParameteri(s, GL_TEXTURE_WRAP_T, kinds[i].wrap);
        gl.SamplerParameterfv(s, GL_TEXTURE_BORDER_COLOR, border);
        if (kinds[i].compare) {
            gl.SamplerParameteri(s, GL_TEXTURE_COMPARE_MODE, GL_COMPARE_REF_TO_TEXTURE);
            gl.SamplerParameteri(s, GL_TEXTURE_COMPARE_FUNC, GL_LEQUAL);
        }
    }
}

void gl_samplers_finish(struct gl_samplers *samplers)
{
    gl.DeleteSamplers(GL_SAMPLER_KINDS, samplers->names);
    memset(samplers, 0, sizeof *samplers);
}
