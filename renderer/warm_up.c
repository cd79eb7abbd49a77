/* What is drawn here nobody sees: each program has to have run, no more. No program depends on the size
 * of a picture or a map, or on the number of triangles and of light samples, and drawing, not
 * compiling, is what took the time with larger ones. */
#include "renderer/generate/generate.h"
#include "renderer/gl/timer.h"
#include "renderer/renderer.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

#define TRIANGLES 64
#define MAP_TEXELS 256
#define ENDLESS_MS 1e9 /* in pieces, between which it is asked who calls */
#define SAMPLES 32     /* rays want more than those of their pre-test, or it is left out */

static void set(struct pen_request *request, const struct pen_technique_info *method,
    const char *name, double value)
{
    const struct pen_param *row = pen_param_find(method->params, name);
    if (row && row->min <= value && value <= row->max)
        pen_param_store(row, request->technique_params, &value, "", NULL);
}

/* gives_way: where somebody calls, it is left as it is. */
static void run_method(struct pen_renderer *r, const uint8_t *scene,
    const struct pen_technique_info *method, bool gives_way)
{
    struct pen_request request;
    struct pen_result result;
    struct pen_frame frame;
    pen_request_default(&request, pen_renderer_catalogue());
    memcpy(request.scene, scene, PEN_ID_BYTES);
    memset(request.technique, 0, sizeof request.technique);
    strcpy(request.technique, method->name);
    memset(request.technique_params, 0, sizeof request.technique_params);
    pen_params_default(method->params, request.technique_params);
    set(&request, method, "map_size", MAP_TEXELS);
    set(&request, method, "samples", SAMPLES);
    request.width = 64, request.height = 48;
    struct pen_render *render = pen_render_begin(r, &request, &frame, &result, NULL);
    while (render && !pen_render_advance(render, gives_way ? ENDLESS_MS : INFINITY) &&
           !(gives_way && pen_renderer_is_called(r)))
        ;
    if (render && pen_render_end(render, NULL))
        pen_frame_finish(&frame);
}

/* Glossy and dull materials are shaded by two programs. */
static void polish(void *blob, size_t bytes)
{
    struct psc_scene scene;
    if (!psc_open_memory(blob, bytes, &scene, NULL))
        return;
    for (uint32_t i = 0; i < scene.material_count; i++)
        ((struct psc_material *)(uintptr_t)scene.materials)[i].roughness = 0.3f;
    psc_close(&scene);
}

static bool load_generated(
    struct pen_renderer *r, uint32_t kind, bool glossy, uint8_t id[PEN_ID_BYTES])
{
    struct pen_generated_options options = {.kind = kind, .triangles = TRIANGLES};
    void *data = NULL;
    size_t bytes = 0;
    const uint8_t name[PEN_ID_BYTES] = {'w', 'a', 'r', 'm', (uint8_t)kind};
    memcpy(id, name, PEN_ID_BYTES);
    if (!pen_generate_blob(&options, &data, &bytes, NULL))
        return false;
    if (glossy)
        polish(data, bytes);
    int fd = memfd_create("warm-up", MFD_CLOEXEC);
    bool ok = fd >= 0 && write(fd, data, bytes) == (ssize_t)bytes &&
              pen_renderer_load_scene(r, id, fd, NULL);
    if (fd >= 0)
        close(fd);
    free(data);
    return ok;
}

double pen_renderer_warm_up(struct pen_renderer *r, enum pen_warm_up how_much)
{
    /* Solid and alpha-masked casters; and without any normals or textures but the mask's. */
    static const uint32_t kinds[] = {PEN_GENERATED_FOLIAGE, PEN_GENERATED_PLANAR_MASK};
    const struct pen_catalogue *catalogue = pen_renderer_catalogue();
    struct pen_request usual;
    pen_request_default(&usual, catalogue);
    bool usual_only = how_much == PEN_WARM_USUAL;
    double begin = gl_now_ms();
    for (uint32_t k = 0; k < sizeof kinds / sizeof *kinds; k++) {
        uint8_t scene[PEN_ID_BYTES];
        if (usual_only && pen_renderer_is_called(r))
            break;
        if (!load_generated(r, kinds[k], k == 0, scene))
            continue;
        for (uint32_t i = 0; i < catalogue->count; i++)
            if (!usual_only || !strcmp(catalogue->items[i]->name, usual.technique))
                run_method(r, scene, catalogue->items[i], usual_only);
        pen_renderer_drop_scene(r, scene);
    }
    return gl_now_ms() - begin;
}
