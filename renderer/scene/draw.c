#include "protocol/memory.h"
#include "renderer/scene/scene.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

static void bind_textures(struct scene *s, uint32_t material)
{
    const struct psc_material *m = &s->blob.materials[material];
    for (int i = 0; i < SCENE_UNITS; i++) {
        int32_t texture = scene_slot(m, i)->texture;
        bool any =
            texture >= 0; /* nothing is left of the material before: it would be compiled for */
        gl.BindTextureUnit((GLuint)i, any ? s->images[s->blob.textures[texture].image].name : 0);
        gl.BindSampler((GLuint)i, any ? s->samplers[texture] : 0);
    }
}

/* Seen from inside, a closed surface shows its back. */
static bool is_inside(const struct scene *s, const struct scene_group *g, const float eye[3])
{
    for (uint32_t i = 0; i < g->count; i++) {
        const float(*b)[3] = s->instance_bounds[s->order[g->first + i]];
        if (eye[0] >= b[0][0] && eye[0] <= b[1][0] && eye[1] >= b[0][1] && eye[1] <= b[1][1] &&
            eye[2] >= b[0][2] && eye[2] <= b[1][2])
            return true;
    }
    return false;
}

bool scene_culls_back(
    const struct scene *s, const struct scene_group *group, const struct cull_view *view)
{
    if (view->faces == CULL_CLOSED)
        return group->closed && (view->parallel || !is_inside(s, group, view->eye));
    return view->faces == CULL_SINGLE_SIDED && !group->double_sided;
}

static bool needs_textures(const struct scene_pass *pass, const struct scene_group *group)
{
    return group->alpha || (pass->full && group->textured);
}

struct placed {
    float away;
    uint32_t instance;
};

static int compare_placed(const void *a, const void *b)
{
    const struct placed *x = a, *y = b;
    if (x->away != y->away)
        return x->away < y->away ? -1 : 1;
    return x->instance < y->instance ? -1 : x->instance > y->instance;
}

/* How far the middle of an instance is from the eye; its square, or without one along the view. */
static float distance_of(const struct scene *s, const struct cull_view *view, uint32_t instance)
{
    const float(*b)[3] = s->instance_bounds[instance];
    float sum = 0;
    for (int c = 0; c < 3; c++) {
        float middle = 0.5f * (b[0][c] + b[1][c]), to = middle - view->eye[c];
        sum += view->parallel ? middle * view->eye[c] : to * to;
    }
    return sum == sum ? sum : 0;
}

static void sort_by_distance(struct scene *s, const struct cull_view *view)
{
    struct placed *placed = pen_alloc(s->blob.instance_count + 1, sizeof *placed);
    for (uint32_t g = 0; g < s->group_count; g++) {
        const struct scene_group *group = &s->groups[g];
        if (!group->alpha)
            continue;
        for (uint32_t i = 0; i < group->count; i++) {
            uint32_t instance = s->order[group->first + i];
            placed[i] = (struct placed){distance_of(s, view, instance), instance};
        }
        qsort(placed, group->count, sizeof *placed, compare_placed);
        for (uint32_t i = 0; i < group->count; i++)
            s->nearest[group->first + i] = placed[i].instance;
    }
    free(placed);
    memcpy(s->nearest_eye, view->eye, sizeof s->nearest_eye);
    s->nearest_parallel = view->parallel;
    s->nearest_known = true;
}

/* The order in which a group's instances are drawn. Where a map only takes depths and looks up alpha for
 * them, the nearest come first: what they hide is not looked up, and what a stack of blended surfaces
 * costs does not grow with its height. */
static const uint32_t *order_of(struct scene *s, const struct cull_view *view,
    const struct scene_pass *pass, const struct scene_group *group)
{
    if (pass->full || !group->alpha || group->count < 2)
        return s->order + group->first;
    if (!s->nearest_known || s->nearest_parallel != view->parallel ||
        memcmp(s->nearest_eye, view->eye, sizeof s->nearest_eye) != 0)
        sort_by_distance(s, view);
    return s->nearest + group->first;
}

/* The commands of one group within a piece of a drawing. */
struct run {
    uint32_t group, first, count;
    bool cull_back;
};

/* Fills the piece: what is to be drawn of each group. Returns the triangles. */
static uint64_t gather(struct scene *s, const struct cull_view *view, const struct scene_pass *pass,
    struct cull_piece *piece, struct run *runs, uint32_t *run_count)
{
    struct cull_list list = {&s->blob, s->meshlet_areas, s->command_room, 0, s->command_count, 1};
    uint64_t triangles = 0;
    piece->more = piece->compiles = false;
    for (; piece->group < s->group_count; piece->group++, piece->instance = 0) {
        const struct scene_group *group = &s->groups[piece->group];
        struct run *run = &runs[*run_count];
        *run = (struct run){piece->group, list.count, 0, scene_culls_back(s, group, view)};
        list.weight = needs_textures(pass, group) ? CULL_TEXTURED_WEIGHT : 1;
        if (pass->blended && !group->blend)
            continue;
        GLuint program = needs_textures(pass, group) ? pass->textured : pass->opaque;
        bool is_new = gl_states_is_new(&s->states, group->state, program);
        piece->more = is_new && *run_count > 0 && isfinite(piece->most);
        if (piece->more)
            break;
        const uint32_t *order = order_of(s, view, pass, group);
        for (; piece->instance < group->count && !piece->more; piece->instance++) {
            uint32_t instance = order[piece->instance];
            if (!pass->hidden || !pass->hidden[instance])
                triangles += cull_instance(view, instance, run->cull_back, &list, piece);
            if (piece->more)
                break;
        }
        run->count = list.count - run->first;
        *run_count += run->count > 0;
        if (run->count) {
            piece->work += CULL_STATE_WORK;
            piece->compiles |= is_new;
            gl_states_is_drawn(&s->states, group->state, program);
        }
        if (piece->more)
            break;
    }
    return triangles;
}

uint64_t scene_draw(struct scene *s, const struct cull_view *view, const struct scene_pass *pass,
    struct cull_piece *piece)
{
    uint32_t run_count = 0;
    struct run *runs = pen_alloc_zero(s->group_count + 1, sizeof *runs);
    uint64_t triangles = gather(s, view, pass, piece, runs, &run_count);
    if (!run_count)
        goto done;
    const struct run *last = &runs[run_count - 1];
    gl.NamedBufferData(s->commands,
        (GLsizeiptr)((last->first + last->count) * sizeof *s->command_room), s->command_room,
        GL_STREAM_DRAW);
    gl.BindBuffer(GL_DRAW_INDIRECT_BUFFER, s->commands);
    for (const struct run *run = runs; run <= last; run++) {
        const struct scene_group *group = &s->groups[run->group];
        bool textured = needs_textures(pass, group);
        gl.UseProgram(textured ? pass->textured : pass->opaque);
        gl.BindVertexArray(pass->full || textured ? s->full_array : s->depth_array);
        if (pass->full || textured)
            gl.BindBufferRange(GL_UNIFORM_BUFFER, UBO_MATERIALS, s->materials,
                (GLintptr)(group->material * sizeof(struct material_record)),
                sizeof(struct materials_block));
        if (textured)
            bind_textures(s, group->material);
        if (run->cull_back)
            gl.Enable(GL_CULL_FACE);
        else
            gl.Disable(GL_CULL_FACE);
        gl.FrontFace(group->mirrored != pass->front_is_clockwise ? GL_CW : GL_CCW);
        gl.MultiDrawElementsIndirect(GL_TRIANGLES, GL_UNSIGNED_INT,
            (const void *)(uintptr_t)(run->first * sizeof *s->command_room), (GLsizei)run->count,
            0);
    }
    gl.Disable(GL_CULL_FACE);
    gl.FrontFace(GL_CCW);
    for (GLuint i = 0; i < SCENE_UNITS; i++)
        gl.BindSampler(i, 0);
done:
    free(runs);
    return triangles;
}
