#include "renderer/frame/shade.h"
#include "renderer/frame/edges.h"
#include "renderer/frame/output.h"
#include "renderer/frame/needs.h"
#include "renderer/passes/draw/screen.h"
#include <cglm/cglm.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#define SHARED_ROWS "renderer/shaders/frame/shade.def"
#include "renderer/shared/rows_c.h"
#define SHARED_ROWS "renderer/shaders/frame/occlusion.def"
#include "renderer/shared/rows_c.h"

/* Radiance over level: straight up, on the horizon, straight down without a ground. The mean over
 * a half space is about a quarter of a facing white surface in the key light: a contrast of 4. */
#define ZENITH 0.24f
#define HORIZON 0.14f
#define NADIR 0.06f
/* Of a ground in the key light, over its albedo: most of it lies in the light, some in shadow. */
#define GROUND 0.32f

static void sky_choose(struct shade_block *b, const struct pen_request *r, const struct view *view)
{
    if (!r->sky.on)
        return;
    float albedo = (r->ground_albedo[0] + r->ground_albedo[1] + r->ground_albedo[2]) / 3;
    float nadir = r->ground.on ? fmaxf(GROUND * albedo, NADIR) : NADIR;
    b->sky_level[0] = r->sky_level * r->sky_intensity;
    b->sky_level[1] = r->background[0] == PEN_AUTO ? r->sky_level : 0;
    b->sky_gradient[0] = HORIZON;
    b->sky_gradient[1] = 0.5f * (ZENITH - nadir);
    b->sky_gradient[2] = 0.5f * (ZENITH + nadir) - HORIZON;
    /* A large box over the camera's left shoulder, a narrow one behind the subject to the right:
     * they turn with the camera, as the key light does. */
    const float place[SKY_BOXES][4] = {{-0.55f, 0.75f, 0.35f, 0.7f}, {0.8f, 0.45f, -0.55f, 0.8f}};
    float back[3] = {-view->forward[0], 0, -view->forward[2]}, right[3];
    if (glm_vec3_norm(back) < 1e-3f)
        back[0] = -view->up[0], back[2] = -view->up[2];
    glm_vec3_normalize(back);
    glm_vec3_cross((float[]){0, 1, 0}, back, right);
    for (int i = 0; i < SKY_BOXES; i++) {
        for (int k = 0; k < 3; k++)
            b->sky_box[i][k] = place[i][0] * right[k] + place[i][2] * back[k];
        b->sky_box[i][1] += place[i][1];
        glm_vec3_normalize(b->sky_box[i]);
        b->sky_box[i][3] = place[i][3];
    }
}

bool sky_occlusion(const struct frame_job *job, const struct gbuffer *gbuffer,
    const struct gl_texture *solid, struct pen_error *error)
{
    struct frame_targets *t = job->targets;
    if (!solid && t->sky_of == gbuffer && t->sky_drawn == gbuffer->drawn)
        return true;
    t->sky_of = NULL;
    uint32_t width = (job->request->width + 1) / 2, height = (job->request->height + 1) / 2;
    const struct occlusion_block reach = {
        .reach = {0.6f * scene_radius(job->scene), 0.35f * (float)job->request->height}};
    struct pass_texture textures[] = {{UNIT_DEPTH, gbuffer->depth.texture.name, GL_SAMPLE_NEAREST},
        {UNIT_NORMAL, gbuffer->normal.texture.name, GL_SAMPLE_NEAREST},
        {UNIT_SOLID, solid ? solid->name : 0, GL_SAMPLE_NEAREST}};
    gl_target_fit(&t->sky_open[0], GL_RG32F, width, height, 0, 1);
    gl_target_fit(&t->sky_open[1], GL_RG32F, width, height, 0, 1);
    struct pass_fill pass = {.name = "sky occlusion",
        .fragment = "occlusion.frag",
        .defines = solid ? "#define LAYER\n" : NULL,
        .stage = PEN_STAGE_SHADE,
        .textures = textures,
        .texture_count = solid ? 3 : 2,
        .framebuffer = t->sky_open[0].framebuffer,
        .width = width,
        .height = height,
        .extra = &reach,
        .extra_bytes = sizeof reach};
    if (!pass_fill(job->ctx, &pass, error))
        return false;
    struct pass_texture noisy = {UNIT_SOURCE, t->sky_open[0].texture.name, GL_SAMPLE_NEAREST};
    pass.name = "sky occlusion blur";
    pass.fragment = "occlusion_blur.frag";
    pass.defines = NULL;
    pass.textures = &noisy;
    pass.texture_count = 1;
    pass.framebuffer = t->sky_open[1].framebuffer;
    pass.extra = NULL;
    if (!pass_fill(job->ctx, &pass, error))
        return false;
    t->sky_of = solid ? NULL : gbuffer;
    t->sky_drawn = gbuffer->drawn;
    return true;
}

static void scale3(float out[4], const float v[3], float factor, float w)
{
    for (int i = 0; i < 3; i++)
        out[i] = v[i] * factor;
    out[3] = w;
}

static void make_shade_block(
    const struct frame_job *job, const struct shading *f, struct shade_block *b)
{
    memset(b, 0, sizeof *b);
    sky_choose(b, job->request, f->view);
    for (uint32_t i = 0; i < f->light_count; i++) {
        const struct light *l = &f->lights[i];
        const struct light_face *face = &l->faces[0];
        const struct pen_light *s = l->source;
        scale3(b->lights[i].origin, l->origin, 1, (float)s->type);
        scale3(b->lights[i].half_x, l->x, face->extent[0], s->radius);
        scale3(b->lights[i].half_y, l->y, face->extent[1], cosf(glm_rad(s->inner_cone_deg)));
        scale3(b->lights[i].z, l->z, 1, cosf(glm_rad(s->outer_cone_deg)));
        scale3(b->lights[i].radiance, l->radiance, 1, 0);
        scale3(b->lights[i].open, face->emission_mean, 1, 0);
    }
}

static bool fill(const struct frame_job *job, struct pass_fill *pass, const char *name,
    enum pass_where where, const char *defines, uint32_t lights, struct pen_error *error)
{
    char all[400];
    snprintf(all, sizeof all, "#define LIGHTS %u\n%s%s", lights, defines,
        where == PASS_BACKGROUND ? "#define BACKGROUND\n" : "");
    pass->name = name;
    pass->where = where;
    pass->defines = all;
    return pass_fill(job->ctx, pass, error);
}

bool frame_shade(const struct frame_job *job, const struct shading *f, struct pen_error *error)
{
    const struct frame_targets *t = job->targets;
    const struct gbuffer *g = f->gbuffer;
    bool direct = frame_output_is_direct(job), layered = frame_is_layered(job),
         emission = g->emission.texture.name != 0;
    const struct gl_target *target = layered                      ? &t->layers
                                     : !direct                    ? &t->beauty
                                     : frame_edges_are_drawn(job) ? &t->stairs
                                                                  : &t->color;
    struct shade_block block;
    make_shade_block(job, f, &block);
    struct pass_texture textures[] = {{UNIT_DEPTH, g->depth.texture.name, GL_SAMPLE_NEAREST},
        {UNIT_NORMAL, g->normal.texture.name, GL_SAMPLE_NEAREST},
        {UNIT_ALBEDO, g->albedo.texture.name, GL_SAMPLE_NEAREST},
        {UNIT_SURFACE, g->surface.texture.name, GL_SAMPLE_NEAREST},
        {UNIT_SOURCE, t->vis.texture.name, GL_SAMPLE_NEAREST},
        {UNIT_SKY_OPEN, t->sky_open[1].texture.name, GL_SAMPLE_NEAREST},
        {UNIT_EMITTED, g->emission.texture.name, GL_SAMPLE_NEAREST}};
    bool rect = false, round = false, punctual = false;
    for (uint32_t i = 0; i < f->light_count; i++) {
        uint32_t type = f->lights[i].source->type;
        rect |= type == PEN_LIGHT_RECT;
        round |= type == PEN_LIGHT_DISK || type == PEN_LIGHT_SPHERE;
        punctual |= type >= PEN_LIGHT_SUN;
    }
    char defines[320];
    snprintf(defines, sizeof defines, "%s%s%s%s%s%s%s%s%s%s%s", layered ? "#define LAYERED\n" : "",
        f->layer ? "#define LAYER\n" : "",
        pen_request_is_transparent(job->request) ? "#define TRANSPARENT\n" : "",
        job->request->ground.on == PEN_FLAG_WORD && !f->layer ? "#define CATCHER\n" : "",
        job->request->sky.on ? "#define SKY\n" : "",
        job->scene->has_gloss ? "#define GLOSSY\n" : "", direct ? "#define RESOLVE\n" : "",
        emission ? "#define EMIT\n" : "", rect ? "#define HAS_RECT\n" : "",
        round ? "#define HAS_ROUND\n" : "", punctual ? "#define HAS_PUNCTUAL\n" : "");
    struct pass_fill pass = {.fragment = "shade.frag",
        .stage = PEN_STAGE_SHADE,
        .textures = textures,
        .texture_count = emission ? 7 : 6,
        .framebuffer = target->framebuffer,
        .width = job->request->width,
        .height = job->request->height,
        .tiles = f->tiles,
        .depth = g->depth.texture.name,
        .add = !direct && !layered,
        .under = layered,
        .extra = &block,
        .extra_bytes = sizeof block};
    return fill(job, &pass, "shade", PASS_SURFACES, defines, f->light_count, error) &&
           fill(job, &pass, "background", PASS_BACKGROUND, defines, 0, error);
}
