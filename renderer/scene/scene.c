#include "renderer/scene/scene.h"
#include "protocol/memory.h"
#include "protocol/number.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Instance attribute: three matrix rows and the material, 64 bytes. */
struct instance_record {
    float rows[12];
    uint32_t material;
    uint32_t pad[3];
};

static GLuint make_buffer(struct scene *s, const void *data, size_t bytes)
{
    GLuint name;
    gl.CreateBuffers(1, &name);
    gl.NamedBufferStorage(name, bytes ? (GLsizeiptr)bytes : 16, bytes ? data : NULL, 0);
    s->bytes += bytes;
    return name;
}

static const struct psc_texture_ref *slot(const struct psc_material *m, int i)
{
    const struct psc_texture_ref *slots[SCENE_UNITS] = {
        &m->base, &m->surface, &m->normal, &m->occlusion, &m->emission};
    return slots[i];
}

static bool has_textures(const struct psc_material *m)
{
    for (int i = 0; i < SCENE_UNITS; i++)
        if (slot(m, i)->texture >= 0)
            return true;
    return false;
}

static void upload_materials(struct scene *s)
{
    uint32_t n = s->blob.material_count;
    struct material_record *records = pen_alloc_zero(n, sizeof *records);
    for (uint32_t i = 0; i < n; i++) {
        const struct psc_material *m = &s->blob.materials[i];
        struct material_record *r = &records[i];
        memcpy(r->base_color, m->base_color, 16);
        memcpy(r->emissive, m->emissive, 12);
        r->emissive[3] = m->alpha_cutoff;
        r->surface[0] = m->metallic, r->surface[1] = m->roughness;
        r->surface[2] = m->occlusion_strength, r->surface[3] = m->normal_scale;
        memcpy(r->specular, m->specular, 12);
        r->specular[3] = m->glossiness;
        r->flags[0] = m->alpha_mode, r->flags[1] = m->flags;
        for (int k = 0; k < SCENE_UNITS; k++) {
            const struct psc_texture_ref *ref = slot(m, k);
            if (ref->texture >= 0)
                r->flags[2] |= 1u << k;
            r->flags[3] |= (ref->uv_set & 1) << k;
            memcpy(r->transforms[2 * k], ref->transform, 12);
            memcpy(r->transforms[2 * k + 1], ref->transform + 3, 12);
        }
        s->has_emission |= m->emissive[0] + m->emissive[1] + m->emissive[2] > 0;
        bool gloss =
            m->flags & PSC_SPECULAR_GLOSSINESS ? m->glossiness > 0.5f : m->roughness < 0.5f;
        s->has_gloss |= gloss || m->surface.texture >= 0;
        s->has_unlit |= (m->flags & PSC_UNLIT) != 0;
    }
    s->materials = make_buffer(s, records, n * sizeof *records);
    free(records);
}

static void upload_instances(struct scene *s)
{
    uint32_t n = s->blob.instance_count;
    struct instance_record *records = pen_alloc_zero(n, sizeof *records);
    for (uint32_t i = 0; i < n; i++) {
        memcpy(records[i].rows, s->blob.instances[i].world, 48);
        records[i].material = s->blob.primitives[s->blob.instances[i].primitive].material;
    }
    s->instances = make_buffer(s, records, n * sizeof *records);
    free(records);
}

static void upload_images(struct scene *s)
{
    s->images = pen_alloc_zero(s->blob.image_count + 1, sizeof *s->images);
    s->samplers = pen_alloc_zero(s->blob.texture_count + 1, sizeof *s->samplers);
    for (uint32_t i = 0; i < s->blob.image_count; i++) {
        const struct psc_image *image = &s->blob.images[i];
        s->images[i] = gl_texture_create(
            image->srgb ? GL_SRGB8_ALPHA8 : GL_RGBA8, image->width, image->height, 0, 0);
        const uint8_t *texels = s->blob.texels + image->first_byte;
        for (uint32_t l = 0; l < image->levels; l++) {
            uint32_t w = image->width >> l ? image->width >> l : 1;
            uint32_t h = image->height >> l ? image->height >> l : 1;
            gl.TextureSubImage2D(s->images[i].name, (GLint)l, 0, 0, (GLsizei)w, (GLsizei)h, GL_RGBA,
                GL_UNSIGNED_BYTE, texels);
            texels += (size_t)4 * w * h;
        }
        s->bytes += s->images[i].bytes;
    }
    static const GLint wraps[] = {GL_REPEAT, GL_CLAMP_TO_EDGE, GL_MIRRORED_REPEAT};
    for (uint32_t i = 0; i < s->blob.texture_count; i++) {
        const struct psc_texture *t = &s->blob.textures[i];
        bool near_min = t->nearest & 2, near_mip = t->nearest & 4, no_mips = t->nearest & 8;
        GLint min = no_mips    ? (near_min ? GL_NEAREST : GL_LINEAR)
                    : near_mip ? (near_min ? GL_NEAREST_MIPMAP_NEAREST : GL_LINEAR_MIPMAP_NEAREST)
                               : (near_min ? GL_NEAREST_MIPMAP_LINEAR : GL_LINEAR_MIPMAP_LINEAR);
        gl.CreateSamplers(1, &s->samplers[i]);
        gl.SamplerParameteri(s->samplers[i], GL_TEXTURE_MIN_FILTER, min);
        gl.SamplerParameteri(
            s->samplers[i], GL_TEXTURE_MAG_FILTER, t->nearest & 1 ? GL_NEAREST : GL_LINEAR);
        gl.SamplerParameteri(s->samplers[i], GL_TEXTURE_WRAP_S, wraps[t->wrap_s % 3]);
        gl.SamplerParameteri(s->samplers[i], GL_TEXTURE_WRAP_T, wraps[t->wrap_t % 3]);
    }
}

static void bind_stream(GLuint array, GLuint attribute, GLuint binding, GLint size, GLenum type,
    GLboolean normalised, GLuint offset)
{
    gl.EnableVertexArrayAttrib(array, attribute);
    gl.VertexArrayAttribFormat(array, attribute, size, type, normalised, offset);
    gl.VertexArrayAttribBinding(array, attribute, binding);
}

/* The material is a float: exact up to 2^24. */
static GLuint make_array(struct scene *s, bool full)
{
    GLuint a;
    gl.CreateVertexArrays(1, &a);
    gl.VertexArrayElementBuffer(a, s->indices);
    gl.VertexArrayVertexBuffer(a, 0, s->positions, 0, 12);
    bind_stream(a, ATTRIBUTE_POSITION, 0, 3, GL_FLOAT, GL_FALSE, 0);
    if (full) {
        gl.VertexArrayVertexBuffer(a, 1, s->attributes, 0, sizeof(struct psc_attributes));
        bind_stream(
            a, ATTRIBUTE_NORMAL, 1, 4, GL_SHORT, GL_TRUE, offsetof(struct psc_attributes, normal));
        bind_stream(a, ATTRIBUTE_TANGENT, 1, 4, GL_SHORT, GL_TRUE,
            offsetof(struct psc_attributes, tangent));
        bind_stream(a, ATTRIBUTE_UV, 1, 4, GL_FLOAT, GL_FALSE, offsetof(struct psc_attributes, uv));
        bind_stream(a, ATTRIBUTE_COLOR, 1, 4, GL_UNSIGNED_BYTE, GL_TRUE,
            offsetof(struct psc_attributes, color));
    }
    gl.VertexArrayVertexBuffer(a, 2, s->instances, 0, sizeof(struct instance_record));
    gl.VertexArrayBindingDivisor(a, 2, 1);
    for (GLuint row = 0; row < 3; row++)
        bind_stream(a, ATTRIBUTE_ROW0 + row, 2, 4, GL_FLOAT, GL_FALSE, 16 * row);
    bind_stream(a, ATTRIBUTE_MATERIAL, 2, 1, GL_UNSIGNED_INT, GL_FALSE,
        offsetof(struct instance_record, material));
    return a;
}

static const struct psc_material *material_of(const struct scene *s, uint32_t instance)
{
    return &s->blob.materials[s->blob.primitives[s->blob.instances[instance].primitive].material];
}

static bool is_closed(const struct scene *s, uint32_t instance)
{
    const struct psc_primitive *p = &s->blob.primitives[s->blob.instances[instance].primitive];
    return (p->flags & PSC_OUTWARD) && material_of(s, instance)->alpha_mode == PSC_OPAQUE;
}

static uint64_t state_key(const struct scene *s, uint32_t instance)
{
    const struct psc_material *m = material_of(s, instance);
    bool alpha = m->alpha_mode != PSC_OPAQUE;
    uint64_t textured = has_textures(m) || alpha
                            ? 1 + s->blob.primitives[s->blob.instances[instance].primitive].material
                            : 0;
    return (uint64_t)is_closed(s, instance) << 41 | (uint64_t)alpha << 40 |
           (uint64_t)((m->flags & PSC_DOUBLE_SIDED) != 0) << 39 |
           (uint64_t)(s->blob.instances[instance].flags & PSC_MIRRORED) << 38 | textured;
}

struct sortable {
    uint64_t key;
    uint32_t instance;
};

static int compare_keys(const void *a, const void *b)
{
    const struct sortable *x = a, *y = b;
    if (x->key != y->key)
        return x->key < y->key ? -1 : 1;
    return x->instance < y->instance ? -1 : x->instance > y->instance;
}

static void make_groups(struct scene *s)
{
    uint32_t n = s->blob.instance_count;
    uint64_t meshlets = 0;
    struct sortable *sorted = pen_alloc_zero(n + 1, sizeof *sorted);
    s->order = pen_alloc_zero(n + 1, sizeof *s->order);
    s->groups = pen_alloc_zero(n + 1, sizeof *s->groups);
    for (uint32_t i = 0; i < n; i++) {
        sorted[i] = (struct sortable){state_key(s, i), i};
        meshlets += s->blob.primitives[s->blob.instances[i].primitive].meshlet_count;
    }
    qsort(sorted, n, sizeof *sorted, compare_keys);
    for (uint32_t i = 0; i < n; i++) {
        s->order[i] = sorted[i].instance;
        if (!i || sorted[i].key != sorted[i - 1].key) {
            const struct psc_material *m = material_of(s, sorted[i].instance);
            uint32_t material = (uint32_t)sorted[i].key;
            s->groups[s->group_count++] = (struct scene_group){.first = i,
                .material = material ? material - 1 : UINT32_MAX,
                .double_sided = (m->flags & PSC_DOUBLE_SIDED) != 0,
                .mirrored = (s->blob.instances[sorted[i].instance].flags & PSC_MIRRORED) != 0,
                .closed = is_closed(s, sorted[i].instance),
                .alpha = m->alpha_mode != PSC_OPAQUE};
        }
        s->groups[s->group_count - 1].count++;
    }
    free(sorted);
    s->command_room = pen_alloc(meshlets + 1, sizeof *s->command_room);
    gl.CreateBuffers(1, &s->commands);
}

static void bound_instances(struct scene *s);
static void find_content(struct scene *s);

static struct scene *upload(struct scene *s, struct pen_error *error)
{
    while (gl.GetError() != GL_NO_ERROR)
        ;
    s->positions = make_buffer(s, s->blob.positions, (size_t)12 * s->blob.vertex_count);
    s->attributes = make_buffer(
        s, s->blob.attributes, sizeof(struct psc_attributes) * (size_t)s->blob.vertex_count);
    s->indices = make_buffer(s, s->blob.indices, (size_t)4 * s->blob.index_count);
    upload_materials(s);
    upload_instances(s);
    upload_images(s);
    s->depth_array = make_array(s, false);
    s->full_array = make_array(s, true);
    make_groups(s);
    bound_instances(s);
    find_content(s);
    outline_make(&s->outline, &s->blob, (const float(*)[3])s->content);
    if (gl.GetError() != GL_NO_ERROR) {
        pen_fail(error, PEN_INTERNAL, "", "The GPU has no memory left for this scene.");
        scene_destroy(s);
        return NULL;
    }
    return s;
}

static struct scene *create(const uint8_t id[PEN_ID_BYTES])
{
    struct scene *s = pen_alloc_zero(1, sizeof *s);
    memcpy(s->id, id, PEN_ID_BYTES);
    return s;
}

struct scene *scene_create(const uint8_t id[PEN_ID_BYTES], int fd, struct pen_error *error)
{
    struct scene *s = create(id);
    if (psc_open(fd, &s->blob, error))
        return upload(s, error);
    free(s);
    return NULL;
}

struct scene *scene_create_memory(
    const uint8_t id[PEN_ID_BYTES], const void *data, size_t bytes, struct pen_error *error)
{
    struct scene *s = create(id);
    if (psc_open_memory(data, bytes, &s->blob, error))
        return upload(s, error);
    free(s);
    return NULL;
}

void scene_attach(struct scene *scene, struct scene_attachment *attachment)
{
    attachment->next = scene->attachments;
    scene->attachments = attachment;
    scene->bytes += attachment->bytes;
}

struct scene_attachment *scene_attachment(
    const struct scene *scene, void (*destroy)(struct scene_attachment *attachment))
{
    struct scene_attachment *a = scene->attachments;
    while (a && a->destroy != destroy)
        a = a->next;
    return a;
}

void scene_destroy(struct scene *s)
{
    if (!s)
        return;
    while (s->attachments) {
        struct scene_attachment *attachment = s->attachments;
        s->attachments = attachment->next;
        attachment->destroy(attachment);
    }
    GLuint buffers[] = {
        s->positions, s->attributes, s->indices, s->instances, s->materials, s->commands};
    gl.DeleteBuffers(sizeof buffers / sizeof *buffers, buffers);
    GLuint arrays[] = {s->depth_array, s->full_array};
    gl.DeleteVertexArrays(2, arrays);
    for (uint32_t i = 0; s->images && i < s->blob.image_count; i++)
        gl_texture_destroy(&s->images[i]);
    if (s->samplers)
        gl.DeleteSamplers((GLsizei)s->blob.texture_count, s->samplers);
    free(s->images);
    free(s->samplers);
    free(s->instance_bounds);
    free(s->order);
    free(s->groups);
    free(s->command_room);
    psc_close(&s->blob);
    free(s);
}

bool scene_is_empty(const struct scene *s)
{
    return !(s->blob.header->bounds_min[0] <= s->blob.header->bounds_max[0]);
}

float scene_radius(const struct scene *s)
{
    if (scene_is_empty(s))
        return 1;
    float sum = 0;
    for (int i = 0; i < 3; i++) {
        float d = s->content[1][i] - s->content[0][i];
        sum += d * d;
    }
    return fmaxf(0.5f * sqrtf(sum), 1e-9f);
}

void scene_center(const struct scene *s, float center[3])
{
    for (int i = 0; i < 3; i++)
        center[i] = scene_is_empty(s) ? 0 : 0.5f * (s->content[0][i] + s->content[1][i]);
}

void scene_point_in(const struct scene *s, const double world[3], float point[3])
{
    for (int i = 0; i < 3; i++)
        point[i] = (float)(world[i] - s->blob.header->origin[i]);
}

void scene_point_out(const struct scene *s, const float point[3], double world[3])
{
    for (int i = 0; i < 3; i++)
        world[i] = s->blob.header->origin[i] + pen_widen(point[i]);
}

void scene_direction(const double from[3], const double to[3], float direction[3])
{
    double d[3], size = 0;
    for (int i = 0; i < 3; i++) {
        d[i] = to[i] - from[i];
        size = fmax(size, fabs(d[i]));
    }
    for (int i = 0; i < 3; i++)
        direction[i] = size > 0 ? (float)ldexp(d[i], -ilogb(size)) : 0;
}

/* Vertices transformed for tight bounds, per scene: a few milliseconds' worth. */
#define BOUND_BUDGET (8u << 20)

static void grow(float bounds[2][3], const float m[12], const float p[3])
{
    for (int r = 0; r < 3; r++) {
        float w = m[4 * r] * p[0] + m[4 * r + 1] * p[1] + m[4 * r + 2] * p[2] + m[4 * r + 3];
        bounds[0][r] = fminf(bounds[0][r], w);
        bounds[1][r] = fmaxf(bounds[1][r], w);
    }
}

static void bound_instances(struct scene *s)
{
    uint64_t left = BOUND_BUDGET;
    s->instance_bounds = pen_alloc_zero(s->blob.instance_count, sizeof *s->instance_bounds);
    for (uint32_t i = 0; i < s->blob.instance_count; i++) {
        const struct psc_instance *instance = &s->blob.instances[i];
        const struct psc_primitive *p = &s->blob.primitives[instance->primitive];
        float(*bounds)[3] = s->instance_bounds[i];
        for (int k = 0; k < 3; k++)
            bounds[0][k] = INFINITY, bounds[1][k] = -INFINITY;
        if (p->vertex_count <= left) {
            left -= p->vertex_count;
            for (uint32_t v = 0; v < p->vertex_count; v++)
                grow(bounds, instance->world, s->blob.positions[p->first_vertex + v]);
        } else {
            for (int c = 0; c < 8; c++)
                grow(bounds, instance->world,
                    (float[3]){c & 1 ? p->bounds_max[0] : p->bounds_min[0],
                        c & 2 ? p->bounds_max[1] : p->bounds_min[1],
                        c & 4 ? p->bounds_max[2] : p->bounds_min[2]});
        }
    }
}

void scene_instance_bounds(const struct scene *s, uint32_t instance, float min[3], float max[3])
{
    memcpy(min, s->instance_bounds[instance][0], 12);
    memcpy(max, s->instance_bounds[instance][1], 12);
}

static void find_content(struct scene *s)
{
    const struct psc_header *h = s->blob.header;
    float flat = 1e-4f * (h->bounds_max[1] - h->bounds_min[1]);
    bool any = false;
    for (uint32_t i = 0; i < s->blob.instance_count; i++) {
        float min[3], max[3];
        scene_instance_bounds(s, i, min, max);
        if (max[1] <= h->bounds_min[1] + flat)
            continue; /* a floor at the very bottom */
        for (int k = 0; k < 3; k++) {
            s->content[0][k] = any ? fminf(s->content[0][k], min[k]) : min[k];
            s->content[1][k] = any ? fmaxf(s->content[1][k], max[k]) : max[k];
        }
        any = true;
    }
    if (any) {
        s->content[0][1] = h->bounds_min[1]; /* it stands on that floor */
        return;
    }
    memcpy(s->content[0], h->bounds_min, sizeof s->content[0]);
    memcpy(s->content[1], h->bounds_max, sizeof s->content[1]);
}

static void bind_material(struct scene *s, uint32_t material)
{
    const struct psc_material *m = &s->blob.materials[material];
    for (int i = 0; i < SCENE_UNITS; i++) {
        int32_t texture = slot(m, i)->texture;
        if (texture < 0)
            continue;
        gl.BindTextureUnit((GLuint)i, s->images[s->blob.textures[texture].image].name);
        gl.BindSampler((GLuint)i, s->samplers[texture]);
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

static bool culls_back(
    const struct scene *s, const struct scene_group *group, const struct cull_view *view)
{
    if (view->faces == CULL_CLOSED)
        return group->closed && (view->parallel || !is_inside(s, group, view->eye));
    return view->faces == CULL_SINGLE_SIDED && !group->double_sided;
}

uint64_t scene_draw(struct scene *s, const struct cull_view *view, const struct scene_pass *pass)
{
    struct run {
        uint32_t first, count;
        bool cull_back;
    };
    uint32_t total = 0;
    uint64_t triangles = 0;
    struct run *runs = pen_alloc_zero(s->group_count + 1, sizeof *runs);
    for (uint32_t g = 0; g < s->group_count; g++) {
        runs[g].first = total;
        runs[g].cull_back = culls_back(s, &s->groups[g], view);
        for (uint32_t i = 0; i < s->groups[g].count; i++) {
            uint32_t instance = s->order[s->groups[g].first + i];
            if (!pass->hidden || !pass->hidden[instance])
                triangles += cull_instance(
                    view, &s->blob, instance, runs[g].cull_back, s->command_room, &total);
        }
        runs[g].count = total - runs[g].first;
    }
    if (!total)
        goto done;
    gl.NamedBufferData(s->commands, (GLsizeiptr)(total * sizeof *s->command_room), s->command_room,
        GL_STREAM_DRAW);
    gl.BindBuffer(GL_DRAW_INDIRECT_BUFFER, s->commands);
    gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, STORAGE_MATERIALS, s->materials);
    for (uint32_t g = 0; g < s->group_count; g++) {
        const struct scene_group *group = &s->groups[g];
        if (!runs[g].count)
            continue;
        bool textured = group->alpha || (pass->full && group->material != UINT32_MAX);
        gl.UseProgram(textured ? pass->textured : pass->opaque);
        gl.BindVertexArray(pass->full || textured ? s->full_array : s->depth_array);
        if (textured)
            bind_material(s, group->material);
        if (runs[g].cull_back)
            gl.Enable(GL_CULL_FACE);
        else
            gl.Disable(GL_CULL_FACE);
        gl.FrontFace(group->mirrored != pass->front_is_clockwise ? GL_CW : GL_CCW);
        gl.MultiDrawElementsIndirect(GL_TRIANGLES, GL_UNSIGNED_INT,
            (const void *)(uintptr_t)(runs[g].first * sizeof *s->command_room),
            (GLsizei)runs[g].count, 0);
    }
    gl.Disable(GL_CULL_FACE);
    gl.FrontFace(GL_CCW);
    for (GLuint i = 0; i < SCENE_UNITS; i++)
        gl.BindSampler(i, 0);
done:
    free(runs);
    return triangles;
}
