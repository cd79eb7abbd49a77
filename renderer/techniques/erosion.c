#include "renderer/passes/filter/interleave.h"
#include "renderer/passes/filter/penumbra.h"
#include "renderer/passes/map/depth_map.h"
#include "renderer/passes/map/min_max.h"
#include "renderer/passes/map/shadow_cache.h"
#include "renderer/techniques/map_params.h"
#include <math.h>
#include <string.h>

#define SHARED_ROWS "renderer/techniques/erosion.def"
#include "renderer/shared/rows_c.h"
#define SHARED_ROWS "renderer/techniques/erosion_flood.def"
#include "renderer/shared/rows_c.h"
#define SHARED_ROWS "renderer/techniques/erosion_window.def"
#include "renderer/shared/rows_c.h"
#define SHARED_ROWS "renderer/shaders/map/level.def"
#include "renderer/shared/rows_c.h"

static const char *const variant_names[] = {"pcf", "direct", NULL};
enum { VARIANT_PCF, VARIANT_DIRECT };

struct erosion {
    uint32_t variant;
    uint32_t map_size;
    float bias;
    uint32_t max_radius;
    uint32_t filter_taps;
    float min_filter;
    pen_flag smooth;
    uint32_t fit_radius;
    float depth_sigma;
};

static const struct pen_param rows[] = {
    PARAM(struct erosion, variant, .choices = variant_names, .specialise = 1,
        .help = "Percentage-closer filtering of the penumbrae found (pcf), or a shadow factor "
                "from the distance to the nearest edge (direct)."),
    MAP_SIZE_ROW(struct erosion, 2048),
    BIAS_ROW(struct erosion),
    PARAM(struct erosion, max_radius, .def = 256, .min = 2, .max = 512, .unit = "px",
        .help = "Largest half width of a penumbra on the screen."),
    PARAM(struct erosion, filter_taps, .def = 32, .min = 1, .max = 256,
        .help = "Depth comparisons of the filter; variant pcf."),
    PARAM(struct erosion, min_filter, .def = 1, .min = 0, .max = 16, .unit = "texel",
        .help = "Least half width of the filter; variant pcf."),
    PARAM(struct erosion, smooth, .def = 1,
        .help = "Shifts the taps per pixel and averages 4 x 4 pixels of wide penumbrae; variant "
                "pcf."),
    PARAM(struct erosion, fit_radius, .def = 4, .min = 1, .max = 8, .unit = "px",
        .help = "Reach of the line fit around an edge pixel; variant direct."),
    PARAM(struct erosion, depth_sigma, .def = 0.01, .min = 0.0001, .max = 1,
        .help = "Distance from the receiver's plane beyond which an edge is another surface's, as "
                "a fraction of the distance to the camera; variant direct."),
};

enum { HARD, AXES, EDGES, LINES, ROUGH, SEEDS, SEEDS_NEXT, TARGETS };

/* Screen-sized, from one pass of a light to the next. */
struct state {
    struct gl_target targets[TARGETS];
};

static void destroy(struct technique_ctx *ctx, void *data)
{
    struct state *state = data;
    (void)ctx;
    for (int i = 0; i < TARGETS; i++)
        gl_target_destroy(&state->targets[i]);
}

static const struct gl_target *target(
    const struct technique_run *run, int which, GLenum format, uint32_t levels)
{
    struct state *state = run->state;
    gl_target_fit(&state->targets[which], format, run->width, run->height, 0, levels);
    return &state->targets[which];
}

static GLuint texture(const struct technique_run *run, int which)
{
    const struct state *state = run->state;
    return state->targets[which].texture.name;
}

/* What the two variants share of light space. */
struct inputs {
    const struct shadow_input *map, *min_max;
    const struct gl_texture *tiles; /* or NULL */
    struct unit_block unit;
};

/* The depth of what the light sees, m, the same for all its faces. */
static float depth_of(const struct light *light)
{
    float most = 0;
    for (uint32_t i = 0; i < light->face_count; i++) {
        const struct light_face *face = &light->faces[i];
        most = fmaxf(most, face->parallel ? face->far_z - face->near_z : face->far_z);
    }
    return most;
}

/* Runs `body` over this face's receivers into HARD or AXES. */
static bool write_target(struct technique_run *run, int which, const char *body,
    const struct inputs *inputs, bool border, struct pen_error *error)
{
    const struct state *state = run->state;
    struct pass_texture pyramid = {
        UNIT_MIN_MAX, inputs->min_max->textures[0].name, GL_SAMPLE_NEAREST};
    return pass_screen(run,
        &(struct pass_screen){.name = which == HARD ? "hard shadows" : "penumbra axes",
            .body = body,
            .defines = border ? "#define WITH_BORDER\n" : NULL,
            .shadow = &inputs->map->textures[0],
            .textures = &pyramid,
            .texture_count = 1,
            .tiles = inputs->tiles,
            .framebuffer = state->targets[which].framebuffer,
            .extra = &inputs->unit,
            .extra_bytes = sizeof inputs->unit},
        error);
}

/* The hard shadow buffer. `border`: only this face's, with what lies beyond its border; otherwise
 * it joins the light's other faces. */
static bool write_hard(
    struct technique_run *run, struct inputs *inputs, bool border, struct pen_error *error)
{
    static const float lit[4] = {1};
    const struct erosion *params = run->params;
    const struct gl_target *hard = target(run, HARD, GL_RGBA16F, 1);
    memset(inputs, 0, sizeof *inputs);
    inputs->unit.length[0] = depth_of(run->light);
    inputs->map = pass_caster_map(run, params->map_size, error);
    inputs->min_max = inputs->map ? pass_caster_min_max(run, params->map_size, error) : NULL;
    if (!inputs->min_max)
        return false;
    if (border || pass_is_first_face(run))
        gl_target_clear(hard, lit);
    return pass_penumbra_tiles(
               run, params->map_size, params->min_filter + 1, hard, &inputs->tiles, error) &&
           write_target(run, HARD, "erosion_hard.glsl", inputs, border, error);
}

struct fill {
    const char *name, *fragment, *defines;
    const struct gl_target *target; /* NULL: vis */
    uint32_t target_level;
    struct pass_texture textures[8];
    uint32_t texture_count;
    const void *block;
    uint32_t block_bytes;
};

static bool fill(struct technique_run *run, const struct fill *f, struct pen_error *error)
{
    GLuint framebuffer = run->vis_framebuffer;
    uint32_t width = run->width, height = run->height;
    if (f->target) {
        gl_target_aim(f->target, f->target_level, 0);
        framebuffer = f->target->framebuffer;
        width = width >> f->target_level ? width >> f->target_level : 1;
        height = height >> f->target_level ? height >> f->target_level : 1;
    }
    return pass_fill(run->ctx,
        &(struct pass_fill){.name = f->name,
            .fragment = f->fragment,
            .defines = f->defines,
            .stage = PEN_STAGE_TECHNIQUE,
            .textures = f->textures,
            .texture_count = f->texture_count,
            .framebuffer = framebuffer,
            .width = width,
            .height = height,
            .extra = f->block,
            .extra_bytes = f->block_bytes,
            .info = &run->technique->info,
            .params = run->params},
        error);
}

static bool build_edge_pyramid(
    struct technique_run *run, const struct gl_target *pyramid, struct pen_error *error)
{
    for (uint32_t level = 0; level < pyramid->texture.levels; level++) {
        struct level_block from = {.level = {(int32_t)level - 1}};
        struct fill f = {.name = level ? "edge pyramid" : "edges",
            .fragment = level ? "erosion_pyramid.frag" : "erosion_edges.frag",
            .defines = "#define PYRAMID\n",
            .target = pyramid,
            .target_level = level,
            .textures = {{level ? UNIT_SOURCE : UNIT_HARD, texture(run, level ? EDGES : HARD),
                GL_SAMPLE_NEAREST}},
            .texture_count = 1,
            .block = &from,
            .block_bytes = sizeof from};
        if (!fill(run, &f, error))
            return false;
    }
    return true;
}

static bool record_pcf(struct technique_run *run, struct pen_error *error)
{
    const struct erosion *params = run->params;
    const struct gl_target *pyramid = target(run, EDGES, GL_RGBA16F, 0);
    struct inputs inputs;
    /* Each face filters its own receivers in its own map, so it needs its own edges, also those
     * that lie beyond its border. */
    if (!write_hard(run, &inputs, true, error) || !build_edge_pyramid(run, pyramid, error))
        return false;
    struct pass_texture textures[] = {{UNIT_HARD, texture(run, HARD), GL_SAMPLE_NEAREST},
        {UNIT_EDGES, texture(run, EDGES), GL_SAMPLE_TRILINEAR}};
    struct pass_screen pass = {.name = "erosion",
        .body = "erosion.glsl",
        .shadow = &inputs.map->textures[0],
        .textures = textures,
        .texture_count = 2,
        .tiles = inputs.tiles,
        .extra = &inputs.unit,
        .extra_bytes = sizeof inputs.unit};
    /* The average knows nothing of other faces. */
    bool smooth = params->smooth.on && !run->face->cube;
    return smooth ? pass_interleaved(run, &pass, error) : pass_screen(run, &pass, error);
}

static bool fit_lines(struct technique_run *run, struct pen_error *error)
{
    struct fill find = {.name = "edges",
        .fragment = "erosion_edges.frag",
        .target = target(run, EDGES, GL_RG16F, 1),
        .textures = {{UNIT_HARD, texture(run, HARD), GL_SAMPLE_NEAREST}},
        .texture_count = 1};
    struct fill fit = {.name = "line fit",
        .fragment = "erosion_lines.frag",
        .target = target(run, ROUGH, GL_RGBA16F, 1),
        .textures = {{UNIT_EDGES, texture(run, EDGES), GL_SAMPLE_NEAREST}},
        .texture_count = 1};
    struct fill smooth = {.name = "line fit",
        .fragment = "erosion_smooth.frag",
        .target = target(run, LINES, GL_RGBA16F, 1),
        .textures = {{UNIT_LINES, texture(run, ROUGH), GL_SAMPLE_NEAREST}},
        .texture_count = 1};
    return fill(run, &find, error) && fill(run, &fit, error) && fill(run, &smooth, error);
}

static bool flood(struct technique_run *run, GLuint *seeds, struct pen_error *error)
{
    const struct erosion *params = run->params;
    const struct gl_target *pair[2] = {
        target(run, SEEDS, GL_RG16F, 1), target(run, SEEDS_NEXT, GL_RG16F, 1)};
    static const float none[4] = {EROSION_FAR, EROSION_FAR};
    gl_target_clear(pair[0], none);
    gl_target_clear(pair[1], none);
    int32_t step = 1;
    while (2 * step < (int32_t)params->max_radius)
        step *= 2;
    for (uint32_t i = 0; step; i++, step /= 2) {
        struct flood_block block = {.step = {step}};
        struct fill f = {.name = "jump flood",
            .fragment = "erosion_flood.frag",
            .defines = i ? NULL : "#define FIRST\n",
            .target = pair[i & 1],
            .textures = {{UNIT_DEPTH, run->gbuffer->depth.texture.name, GL_SAMPLE_NEAREST},
                {UNIT_NORMAL, run->gbuffer->normal.texture.name, GL_SAMPLE_NEAREST},
                {UNIT_HARD, texture(run, HARD), GL_SAMPLE_NEAREST},
                {UNIT_AXES, texture(run, AXES), GL_SAMPLE_NEAREST},
                {UNIT_LINES, texture(run, LINES), GL_SAMPLE_NEAREST},
                {UNIT_SEEDS, pair[~i & 1]->texture.name, GL_SAMPLE_NEAREST}},
            .texture_count = i ? 6 : 5,
            .block = &block,
            .block_bytes = sizeof block};
        if (!fill(run, &f, error))
            return false;
        *seeds = pair[i & 1]->texture.name;
    }
    return true;
}

static bool record_direct(struct technique_run *run, struct pen_error *error)
{
    target(run, AXES, GL_RGBA16F, 1);
    struct inputs inputs;
    if (!write_hard(run, &inputs, false, error) ||
        !write_target(run, AXES, "erosion_axes.glsl", &inputs, false, error))
        return false;
    /* From here on nothing is left of light space: edges run on from face to face. */
    if (!pass_is_last_face(run))
        return true;
    GLuint seeds = 0;
    if (!fit_lines(run, error) || !flood(run, &seeds, error))
        return false;
    struct fill f = {.name = "erosion",
        .fragment = "erosion_direct.frag",
        .textures = {{UNIT_DEPTH, run->gbuffer->depth.texture.name, GL_SAMPLE_NEAREST},
            {UNIT_NORMAL, run->gbuffer->normal.texture.name, GL_SAMPLE_NEAREST},
            {UNIT_HARD, texture(run, HARD), GL_SAMPLE_NEAREST},
            {UNIT_AXES, texture(run, AXES), GL_SAMPLE_NEAREST},
            {UNIT_LINES, texture(run, LINES), GL_SAMPLE_NEAREST},
            {UNIT_SEEDS, seeds, GL_SAMPLE_NEAREST}},
        .texture_count = 6};
    return fill(run, &f, error);
}

static bool record(struct technique_run *run, struct pen_error *error)
{
    const struct erosion *params = run->params;
    return params->variant == VARIANT_PCF ? record_pcf(run, error) : record_direct(run, error);
}

const struct technique technique_erosion = {
    .info = {.name = "erosion",
        .title = "Contact hardening by erosion",
        .summary = "Finds the edges of hard shadows on the screen and widens each by its own "
                   "penumbra: then filters the shadow map there, or derives the shadow from the "
                   "distance to a line fitted to the edge.",
        .citation = "A. Klein, A. Nischwitz, P. Obermeier, Contact hardening soft shadows using "
                    "erosion, WSCG 2014",
        .artefacts =
            "Shadow edges off the screen or behind an object have no penumbra; where many "
            "edges meet (foliage) the direct variant knows only the nearest." BLENDED_GRAIN,
        .cost_class = PEN_COST_MEDIUM,
        .textured = false,
        .struct_size = sizeof(struct erosion),
        .params = {rows, sizeof rows / sizeof *rows}},
    .state_size = sizeof(struct state),
    .sketch = "map_size=512 filter_taps=8 max_radius=32",
    .record = record,
    .destroy = destroy,
};
