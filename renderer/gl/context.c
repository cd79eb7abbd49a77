#include "renderer/gl/context.h"
#include "protocol/memory.h"
#include "renderer/gl/gl.h"
#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct gl_api gl;

#define EGL_FUNCTIONS(F)                                                                           \
    F(EGLBoolean, Initialize, (EGLDisplay, EGLint *, EGLint *))                                    \
    F(EGLBoolean, Terminate, (EGLDisplay))                                                         \
    F(EGLBoolean, BindAPI, (EGLenum))                                                              \
    F(EGLContext, CreateContext, (EGLDisplay, EGLConfig, EGLContext, const EGLint *))              \
    F(EGLBoolean, DestroyContext, (EGLDisplay, EGLContext))                                        \
    F(EGLBoolean, MakeCurrent, (EGLDisplay, EGLSurface, EGLSurface, EGLContext))                   \
    F(EGLDisplay, GetPlatformDisplay, (EGLenum, void *, const EGLAttrib *))                        \
    F(const char *, QueryString, (EGLDisplay, EGLint))

struct gl_context {
    void *library;
    EGLDisplay display;
    EGLContext context;
#define EGL_MEMBER(type, name, arguments) type(*name) arguments;
    EGL_FUNCTIONS(EGL_MEMBER)
#undef EGL_MEMBER
    __eglMustCastToProperFunctionPointerType (*GetProcAddress)(const char *);
    void *osmesa; /* OSMesaContext */
    void (*osmesa_destroy)(void *);
    void *osmesa_pixels;
};

static bool has_word(const char *list, const char *word)
{
    size_t length = strlen(word);
    for (const char *at = list; at && (at = strstr(at, word)); at += length)
        if ((at == list || at[-1] == ' ') && (at[length] == ' ' || !at[length]))
            return true;
    return false;
}

typedef void (*any_function)(void);
typedef any_function (*load_function)(const char *);

static bool load_gl(load_function load, struct pen_error *error)
{
    const char *missing = NULL;
    any_function f;
#define GL_LOAD(type, name)                                                                        \
    f = load("gl" #name);                                                                          \
    memcpy(&gl.name, &f, sizeof f);                                                                \
    if (!f)                                                                                        \
        missing = "gl" #name;
    GL_FUNCTIONS(GL_LOAD)
#undef GL_LOAD
    if (missing)
        return pen_fail(error, PEN_UNAVAILABLE, "", "The OpenGL driver lacks %s.", missing);
    return true;
}

static void APIENTRY print_message(GLenum source, GLenum type, GLuint id, GLenum severity,
    GLsizei length, const GLchar *message, const void *user)
{
    (void)source, (void)id, (void)severity, (void)user;
    if (type == GL_DEBUG_TYPE_ERROR)
        fprintf(stderr, "GL error: %.*s\n", (int)length, message);
}

static bool open_egl(struct gl_context *c, struct pen_error *error)
{
    if (c->library)
        return true;
    c->library = dlopen("libEGL.so.1", RTLD_NOW | RTLD_LOCAL);
    if (!c->library)
        return pen_fail(error, PEN_UNAVAILABLE, "", "libEGL.so.1 is not installed.");
    void *f = dlsym(c->library, "eglGetProcAddress");
    memcpy(&c->GetProcAddress, &f, sizeof f);
#define EGL_LOAD(type, name, arguments)                                                            \
    f = dlsym(c->library, "egl" #name);                                                            \
    memcpy(&c->name, &f, sizeof f);                                                                \
    if (!f)                                                                                        \
        return pen_fail(error, PEN_UNAVAILABLE, "", "libEGL lacks egl" #name ".");
    EGL_FUNCTIONS(EGL_LOAD)
#undef EGL_LOAD
    return true;
}

static bool make_egl_context(struct gl_context *c, bool debug, struct pen_error *error)
{
    EGLint major, minor;
    if (c->display == EGL_NO_DISPLAY || !c->Initialize(c->display, &major, &minor)) {
        c->display = EGL_NO_DISPLAY;
        return pen_fail(error, PEN_UNAVAILABLE, "", "EGL could not open the display.");
    }
    const char *extensions = c->QueryString(c->display, EGL_EXTENSIONS);
    bool robust =
        has_word(extensions, "EGL_EXT_create_context_robustness") || (major == 1 && minor >= 5);
    /* Surfaceless displays offer no configs at all, so a config-less context it is. */
    EGLint attributes[] = {EGL_CONTEXT_MAJOR_VERSION, 4, EGL_CONTEXT_MINOR_VERSION, 5,
        EGL_CONTEXT_OPENGL_PROFILE_MASK, EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
        EGL_CONTEXT_OPENGL_DEBUG, debug, EGL_NONE, EGL_NONE, EGL_NONE, EGL_NONE, EGL_NONE};
    int plain = 8;
    if (robust) {
        attributes[8] = EGL_CONTEXT_OPENGL_ROBUST_ACCESS, attributes[9] = EGL_TRUE;
        attributes[10] = EGL_CONTEXT_OPENGL_RESET_NOTIFICATION_STRATEGY;
        attributes[11] = EGL_LOSE_CONTEXT_ON_RESET;
    }
    if (!c->BindAPI(EGL_OPENGL_API))
        return pen_fail(error, PEN_UNAVAILABLE, "", "EGL has no desktop OpenGL.");
    c->context = c->CreateContext(c->display, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, attributes);
    if (c->context == EGL_NO_CONTEXT) {
        attributes[plain] = EGL_NONE;
        c->context = c->CreateContext(c->display, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, attributes);
    }
    if (c->context == EGL_NO_CONTEXT ||
        !c->MakeCurrent(c->display, EGL_NO_SURFACE, EGL_NO_SURFACE, c->context))
        return pen_fail(
            error, PEN_UNAVAILABLE, "", "No OpenGL 4.5 core context without a surface.");
    return load_gl((load_function)c->GetProcAddress, error);
}

static void close_display(struct gl_context *c)
{
    if (c->display == EGL_NO_DISPLAY)
        return;
    c->MakeCurrent(c->display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    if (c->context != EGL_NO_CONTEXT)
        c->DestroyContext(c->display, c->context);
    c->Terminate(c->display);
    c->context = EGL_NO_CONTEXT;
    c->display = EGL_NO_DISPLAY;
}

/* The wanted GPU among the EGL devices; software devices are not counted. */
static bool create_on_gpu(
    struct gl_context *c, const struct pen_device_config *config, struct pen_error *error)
{
    if (!open_egl(c, error))
        return false;
    PFNEGLQUERYDEVICESEXTPROC query_devices =
        (PFNEGLQUERYDEVICESEXTPROC)c->GetProcAddress("eglQueryDevicesEXT");
    PFNEGLQUERYDEVICESTRINGEXTPROC query_string =
        (PFNEGLQUERYDEVICESTRINGEXTPROC)c->GetProcAddress("eglQueryDeviceStringEXT");
    EGLDeviceEXT devices[32];
    EGLint count = 0;
    if (!query_devices || !query_string || !query_devices(32, devices, &count))
        return pen_fail(error, PEN_UNAVAILABLE, "", "EGL cannot enumerate devices.");
    uint32_t gpu = 0;
    for (EGLint i = 0; i < count; i++) {
        if (has_word(query_string(devices[i], EGL_EXTENSIONS), "EGL_MESA_device_software"))
            continue;
        if (gpu++ != config->index)
            continue;
        c->display = c->GetPlatformDisplay(EGL_PLATFORM_DEVICE_EXT, devices[i], NULL);
        if (make_egl_context(c, config->debug, error))
            return true;
        close_display(c);
        return false;
    }
    return pen_fail(
        error, PEN_UNAVAILABLE, "", "There is no GPU number %u; EGL sees %u.", config->index, gpu);
}

static bool create_surfaceless(
    struct gl_context *c, const struct pen_device_config *config, struct pen_error *error)
{
    if (!open_egl(c, error))
        return false;
    c->display = c->GetPlatformDisplay(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, NULL);
    if (make_egl_context(c, config->debug, error))
        return true;
    close_display(c);
    return false;
}

/* Mesa dropped OSMesa in 25.1, so it is only ever looked for at run time. */
static bool create_osmesa(struct gl_context *c, struct pen_error *error)
{
    void *library = dlopen("libOSMesa.so.8", RTLD_NOW | RTLD_LOCAL);
    if (!library)
        library = dlopen("libOSMesa.so", RTLD_NOW | RTLD_LOCAL);
    if (!library)
        return pen_fail(error, PEN_UNAVAILABLE, "", "libOSMesa is not installed.");
    void *(*create)(const int *, void *);
    unsigned char (*make_current)(void *, void *, GLenum, GLsizei, GLsizei);
    load_function get_address;
    void *f;
#define OSMESA_LOAD(to, name)                                                                      \
    f = dlsym(library, name);                                                                      \
    memcpy(&to, &f, sizeof f);                                                                     \
    if (!f)                                                                                        \
        return pen_fail(error, PEN_UNAVAILABLE, "", "libOSMesa lacks " name ".");
    OSMESA_LOAD(create, "OSMesaCreateContextAttribs")
    OSMESA_LOAD(make_current, "OSMesaMakeCurrent")
    OSMESA_LOAD(get_address, "OSMesaGetProcAddress")
    OSMESA_LOAD(c->osmesa_destroy, "OSMesaDestroyContext")
#undef OSMESA_LOAD
    /* Tokens of GL/osmesa.h: format RGBA, core profile, version 4.5. */
    const int attributes[] = {0x22, GL_RGBA, 0x33, 0x34, 0x36, 4, 0x37, 5, 0};
    c->osmesa = create(attributes, NULL);
    c->osmesa_pixels = malloc(16 * 16 * 4);
    if (!c->osmesa || !c->osmesa_pixels ||
        !make_current(c->osmesa, c->osmesa_pixels, GL_UNSIGNED_BYTE, 16, 16))
        return pen_fail(error, PEN_UNAVAILABLE, "", "OSMesa gave no OpenGL 4.5 core context.");
    return load_gl(get_address, error);
}

static void describe(struct pen_device_info *info, const char *platform)
{
    memset(info, 0, sizeof *info);
    snprintf(info->renderer, sizeof info->renderer, "%s", (const char *)gl.GetString(GL_RENDERER));
    snprintf(info->version, sizeof info->version, "%s", (const char *)gl.GetString(GL_VERSION));
    snprintf(info->platform, sizeof info->platform, "%s", platform);
    static const char *const software[] = {"llvmpipe", "softpipe", "swrast", "SWR", NULL};
    for (int i = 0; software[i]; i++)
        info->software |= strcasestr(info->renderer, software[i]) != NULL;
}

struct gl_context *gl_context_create(
    const struct pen_device_config *config, struct pen_device_info *info, struct pen_error *error)
{
    struct gl_context *c = pen_alloc_zero(1, sizeof *c);
    const char *platform = NULL;
    struct pen_error gpu = {0}, surfaceless = {0}, osmesa = {0};
    bool any = config->choice == PEN_DEVICE_AUTO;
    if ((any || config->choice == PEN_DEVICE_GPU) && create_on_gpu(c, config, &gpu))
        platform = "egl-device";
    else if (!config->require_gpu && config->choice != PEN_DEVICE_GPU) {
        if ((any || config->choice == PEN_DEVICE_SURFACELESS) &&
            create_surfaceless(c, config, &surfaceless))
            platform = "egl-surfaceless";
        else if ((any || config->choice == PEN_DEVICE_OSMESA) && create_osmesa(c, &osmesa))
            platform = "osmesa";
    }
    if (!platform) {
        pen_fail(error, PEN_UNAVAILABLE, "", "No usable OpenGL device. %s %s %s", gpu.message,
            surfaceless.message, osmesa.message);
        goto fail;
    }
    describe(info, platform);
    if (info->software && config->require_gpu) {
        pen_fail(error, PEN_UNAVAILABLE, "", "A GPU is required, but OpenGL runs on %s.",
            info->renderer);
        goto fail;
    }
    if (config->debug) {
        gl.Enable(GL_DEBUG_OUTPUT);
        gl.Enable(GL_DEBUG_OUTPUT_SYNCHRONOUS);
        gl.DebugMessageCallback(print_message, NULL);
    }
    return c;
fail:
    gl_context_destroy(c);
    return NULL;
}

void gl_context_destroy(struct gl_context *c)
{
    if (!c)
        return;
    if (c->library)
        close_display(c);
    if (c->osmesa)
        c->osmesa_destroy(c->osmesa);
    free(c->osmesa_pixels);
    /* The libraries stay loaded: drivers leave threads and exit handlers behind. */
    free(c);
}
