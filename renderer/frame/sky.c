#include "renderer/frame/sky.h"
#include "renderer/passes/draw/screen.h"
#include <cglm/cglm.h>
#include <math.h>

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

void sky_choose(struct shade_block *b, const struct pen_request *r, const struct view *view)
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
    uint32_t width = (job->request->width + 1) / 2, height = (job->request->height + 1) / 2;
    const struct occlusion_block reach = {
        .reach = {0.6f * scene_radius(job->scene), 0.35f * (float)job->request->height}};
    struct pass_texture textures[] = {{UNIT_DEPTH, gbuffer->depth.texture.name, GL_SAMPLE_NEAREST},
        {UNIT_NORMAL, gbuffer->normal.texture.name, GL_SAMPLE_NEAREST},
        {UNIT_SOLID, solid ? solid->name : 0, GL_SAMPLE_NEAREST}};
    gl_target_fit(&t->sky_open[0], GL_R8, width, height, 0, 1);
    gl_target_fit(&t->sky_open[1], GL_R8, width, height, 0, 1);
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
    textures[2] =
        (struct pass_texture){UNIT_SOURCE, t->sky_open[0].texture.name, GL_SAMPLE_NEAREST};
    pass.name = "sky occlusion blur";
    pass.fragment = "occlusion_blur.frag";
    pass.defines = NULL;
    pass.texture_count = 3;
    pass.framebuffer = t->sky_open[1].framebuffer;
    pass.extra = NULL;
    return pass_fill(job->ctx, &pass, error);
}
