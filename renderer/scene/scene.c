#include "renderer/scene/scene.h"
#include "protocol/fnv.h"
#include "protocol/memory.h"
#include "renderer/pose/pose.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Materials that are bound together. */
#define WINDOW (sizeof(struct materials_block) / sizeof(struct material_record))
#define MOST_COMMANDS (1u << 18) /* at once */
/* Of an image file's texels, mapped and uploaded. */
#define MOST_READ (16u << 20)

/* Instance attribute: three matrix rows and the material, 64 bytes. */
struct instance_record {
    float rows[12];
    uint32_t material;
    uint32_t pad[3];
};

/* No request changes what it is made of. */
static bool is_still(const struct scene *s)
{
    return !s->file.motion.animation_count && !s->file.motion.variant_count;
}

static GLuint make_buffer(struct scene *s, const void *data, size_t bytes)
{
    GLuint name;
    gl.CreateBuffers(1, &name);
    gl.NamedBufferStorage(name, bytes ? (GLsizeiptr)bytes : 16, bytes ? data : NULL,
        is_still(s) ? 0 : GL_DYNAMIC_STORAGE_BIT);
    s->bytes += bytes;
    return name;
}

const struct psc_texture_ref *scene_slot(const struct psc_material *m, int unit)
{
    const struct psc_texture_ref *slots[SCENE_UNITS] = {
        &m->base, &m->surface, &m->normal, &m->occlusion, &m->emission};
    return slots[unit];
}

static bool has_textures(const struct psc_material *m)
{
    for (int i = 0; i < SCENE_UNITS; i++)
        if (scene_slot(m, i)->texture >= 0)
            return true;
    return false;
}

/* Into a new buffer, or the one that there is. */
static void put_buffer(struct scene *s, GLuint *buffer, const void *data, size_t bytes)
{
    if (!*buffer)
        *buffer = make_buffer(s, data, bytes);
    else if (bytes)
        gl.NamedBufferSubData(*buffer, 0, (GLsizeiptr)bytes, data);
}

static void upload_materials(struct scene *s)
{
    uint32_t n = s->blob.material_count,
             room = n + (uint32_t)WINDOW; /* the last binding ends there */
    struct material_record *records = pen_alloc_zero(room, sizeof *records);
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
            const struct psc_texture_ref *ref = scene_slot(m, k);
            if (ref->texture >= 0)
                r->flags[2] |= 1u << k;
            r->flags[3] |= (ref->uv_set & 1) << k;
            memcpy(r->transforms[2 * k], ref->transform, 12);
            memcpy(r->transforms[2 * k + 1], ref->transform + 3, 12);
        }
        s->may_blend |= m->alpha_mode == PSC_BLEND;
    }
    put_buffer(s, &s->materials, records, room * sizeof *records);
    free(records);
}

static void upload_instances(struct scene *s)
{
    uint32_t n = s->file.instance_count; /* those that the pose hides leave room at the end */
    struct instance_record *records = pen_alloc_zero(n, sizeof *records);
    for (uint32_t i = 0; i < s->blob.instance_count; i++) {
        memcpy(records[i].rows, s->blob.instances[i].world, 48);
        records[i].material = s->blob.primitives[s->blob.instances[i].primitive].material % WINDOW;
    }
    put_buffer(s, &s->instances, records, n * sizeof *records);
    free(records);
}

static void upload_images(struct scene *s)
{
    uint64_t read = 0;
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
        read += s->images[i].bytes;
        if (read > MOST_READ) { /* not file and texture both, of all images at a time */
            psc_rest(&s->file);
            read = 0;
        }
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

/* Of what is drawn: a material that no instance wears in this pose and variant costs nothing. */
static void find_kinds(struct scene *s)
{
    s->has_emission = s->has_gloss = s->has_blend = s->has_unlit = false;
    for (uint32_t i = 0; i < s->blob.instance_count; i++) {
        const struct psc_material *m = material_of(s, i);
        bool gloss =
            m->flags & PSC_SPECULAR_GLOSSINESS ? m->glossiness > 0.5f : m->roughness < 0.5f;
        s->has_emission |= m->emissive[0] + m->emissive[1] + m->emissive[2] > 0;
        s->has_gloss |= gloss || m->surface.texture >= 0;
        s->has_blend |= m->alpha_mode == PSC_BLEND;
        s->has_unlit |= (m->flags & PSC_UNLIT) != 0;
    }
}

static bool is_closed(const struct scene *s, uint32_t instance)
{
    const struct psc_primitive *p = &s->blob.primitives[s->blob.instances[instance].primitive];
    return (p->flags & PSC_OUTWARD) && material_of(s, instance)->alpha_mode == PSC_OPAQUE;
}

static uint64_t state_key(const struct scene *s, uint32_t instance)
{
    const struct psc_material *m = material_of(s, instance);
    bool alpha = m->alpha_mode != PSC_OPAQUE, textured = alpha || has_textures(m);
    uint32_t material = s->blob.primitives[s->blob.instances[instance].primitive].material;
    return (uint64_t)is_closed(s, instance) << 41 | (uint64_t)alpha << 40 |
           (uint64_t)((m->flags & PSC_DOUBLE_SIDED) != 0) << 39 |
           (uint64_t)(s->blob.instances[instance].flags & PSC_MIRRORED) << 38 |
           (uint64_t)textured << 37 | (textured ? material : material - material % WINDOW);
}

static bool is_power_of_two(uint32_t x)
{
    return !(x & (x - 1));
}

/* How the textures of a material are looked up; NULL: there are none. */
static uint64_t lookup_key(const struct psc_scene *blob, const struct psc_material *material)
{
    uint64_t key = PEN_FNV_START;
    for (int i = 0; i < SCENE_UNITS && material; i++) {
        int32_t number = scene_slot(material, i)->texture;
        key = pen_fnv(key, &i, sizeof i);
        if (number < 0)
            continue;
        const struct psc_texture *t = &blob->textures[number];
        const struct psc_image *image = &blob->images[t->image];
        uint32_t of[] = {t->wrap_s, t->wrap_t, t->nearest, image->srgb, image->levels > 1,
            is_power_of_two(image->width), is_power_of_two(image->height)};
        key = pen_fnv(key, of, sizeof of);
    }
    return key;
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
    free(s->order);
    free(s->nearest);
    free(s->groups);
    free(s->command_room);
    s->group_count = 0;
    struct sortable *sorted = pen_alloc_zero(n + 1, sizeof *sorted);
    s->order = pen_alloc_zero(n + 1, sizeof *s->order);
    s->nearest = pen_alloc_zero(n + 1, sizeof *s->nearest);
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
            s->groups[s->group_count++] = (struct scene_group){.first = i,
                .material = (uint32_t)sorted[i].key,
                .textured = sorted[i].key >> 37 & 1,
                .double_sided = (m->flags & PSC_DOUBLE_SIDED) != 0,
                .mirrored = (s->blob.instances[sorted[i].instance].flags & PSC_MIRRORED) != 0,
                .closed = is_closed(s, sorted[i].instance),
                .alpha = m->alpha_mode != PSC_OPAQUE,
                .blend = m->alpha_mode == PSC_BLEND};
        }
        s->groups[s->group_count - 1].count++;
    }
    free(sorted);
    memset(&s->states, 0, sizeof s->states);
    for (uint32_t g = 0; g < s->group_count; g++) {
        struct scene_group *group = &s->groups[g];
        const struct psc_material *m = &s->blob.materials[group->material];
        group->state = gl_states_name(&s->states, lookup_key(&s->blob, group->textured ? m : NULL));
    }
    s->command_count = meshlets < MOST_COMMANDS ? (uint32_t)meshlets + 1 : MOST_COMMANDS;
    s->command_room = pen_alloc(s->command_count, sizeof *s->command_room);
}

/* They are found where they are asked for. */
static void forget_areas(struct scene *s)
{
    if (!s->meshlet_areas)
        s->meshlet_areas = pen_alloc(s->blob.meshlet_count + (size_t)1, sizeof *s->meshlet_areas);
    for (uint32_t i = 0; i < s->blob.meshlet_count; i++)
        s->meshlet_areas[i] = -1;
}

static struct scene *upload(struct scene *s)
{
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
    forget_areas(s);
    find_kinds(s);
    gl.CreateBuffers(1, &s->commands);
    scene_measure(s);
    psc_rest(&s->file);
    return s;
}

static struct scene *create(const uint8_t id[PEN_ID_BYTES])
{
    struct scene *s = pen_alloc_zero(1, sizeof *s);
    memcpy(s->id, id, PEN_ID_BYTES);
    return s;
}

/* The rest pose of the file, without what it hides. */
static struct scene *open_file(struct scene *s, struct pen_error *error)
{
    uint32_t changes;
    s->blob = s->file;
    s->pose = (struct scene_pose){-1, 0, -1};
    s->moving_animation = -1;
    for (uint32_t i = 0; i < s->file.instance_count && !s->poses; i++)
        if (s->file.instances[i].flags & PSC_HIDDEN)
            s->poses = pose_create(&s->file);
    if (s->poses && !pose_set(s->poses, -1, 0, &changes, error)) {
        scene_destroy(s);
        return NULL;
    }
    if (s->poses)
        s->blob = *pose_scene(s->poses);
    return upload(s);
}

struct scene *scene_create(const uint8_t id[PEN_ID_BYTES], int fd, struct pen_error *error)
{
    struct scene *s = create(id);
    if (psc_open(fd, &s->file, error))
        return open_file(s, error);
    free(s);
    return NULL;
}

void scene_rest(struct scene *scene)
{
    if (!scene->rests)
        psc_rest(&scene->file);
    scene->rests = true;
}

void scene_attach(struct scene *scene, struct scene_attachment *attachment)
{
    attachment->next = scene->attachments;
    scene->attachments = attachment;
    scene->bytes += attachment->bytes;
}

void scene_attachment_resize(
    struct scene *scene, struct scene_attachment *attachment, uint64_t bytes)
{
    scene->bytes += bytes - attachment->bytes;
    attachment->bytes = bytes;
}

struct scene_attachment *scene_attachment(
    const struct scene *scene, void (*destroy)(struct scene_attachment *attachment))
{
    struct scene_attachment *a = scene->attachments;
    while (a && a->destroy != destroy)
        a = a->next;
    return a;
}

static void remove_attachment(struct scene *scene, struct scene_attachment **at)
{
    struct scene_attachment *attachment = *at;
    *at = attachment->next;
    scene->bytes -= attachment->bytes;
    attachment->destroy(attachment);
}

void scene_detach(struct scene *scene, struct scene_attachment *attachment)
{
    struct scene_attachment **at = &scene->attachments;
    while (*at != attachment)
        at = &(*at)->next;
    remove_attachment(scene, at);
}

bool scene_shed(struct scene *scene)
{
    bool any = scene->attachments;
    while (scene->attachments)
        remove_attachment(scene, &scene->attachments);
    return any;
}

void scene_destroy(struct scene *s)
{
    if (!s)
        return;
    scene_shed(s);
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
    free(s->nearest);
    free(s->groups);
    free(s->command_room);
    free(s->meshlet_areas);
    pose_destroy(s->poses);
    stage_finish(&s->rest_stage);
    stage_finish(&s->moving_stage);
    stage_finish(&s->moved_stage);
    psc_close(&s->file);
    free(s);
}

static void upload_moved(struct scene *s)
{
    uint32_t count;
    const uint32_t *moved = pose_moved(s->poses, &count);
    for (uint32_t i = 0; i < count; i++) {
        const struct psc_primitive *p = &s->blob.primitives[moved[i]];
        size_t first = p->first_vertex, n = p->vertex_count;
        gl.NamedBufferSubData(
            s->positions, (GLintptr)(12 * first), (GLsizeiptr)(12 * n), s->blob.positions[first]);
        gl.NamedBufferSubData(s->attributes, (GLintptr)(first * sizeof(struct psc_attributes)),
            (GLsizeiptr)(n * sizeof(struct psc_attributes)), &s->blob.attributes[first]);
    }
}

/* GPU memory follows the pose: only what moves is written again, textures never. */
static void follow_pose(struct scene *s, uint32_t changes)
{
    s->blob = *pose_scene(s->poses);
    if (changes & POSE_VERTICES)
        upload_moved(s), forget_areas(s);
    if (changes & (POSE_INSTANCES | POSE_STATE | POSE_SURFACES))
        upload_instances(s);
    if (changes & (POSE_STATE | POSE_SURFACES))
        make_groups(s);
    if (changes & POSE_MATERIALS)
        upload_materials(s);
    find_kinds(s);
    scene_measure(s);
    s->moved += (changes & (POSE_VERTICES | POSE_INSTANCES)) != 0;
    s->remade += (changes & (POSE_STATE | POSE_ALPHA | POSE_SURFACES)) != 0;
}

bool scene_set_pose(struct scene *s, const struct pen_request *request, struct pen_error *error)
{
    struct scene_pose pose;
    uint32_t changes;
    if (!pose_find(&s->file, request->animation, &pose.animation, error) ||
        !pose_find_variant(&s->file, request->variant, &pose.variant, error))
        return false;
    pose.time_s = pose_clamp(&s->file, pose.animation, request->time_s);
    if (!memcmp(&pose, &s->pose, sizeof pose))
        return true;
    if (!s->poses)
        s->poses = pose_create(&s->file);
    s->pose = pose;
    bool fits = pose_set(s->poses, pose.animation, pose.time_s, &changes, error);
    if (!fits) { /* back to where nothing is out of range */
        s->pose = (struct scene_pose){-1, 0, -1};
        pose_destroy(s->poses);
        s->poses = pose_create(&s->file);
        pose_set(s->poses, -1, 0, &changes, NULL);
        changes = POSE_VERTICES | POSE_INSTANCES | POSE_STATE | POSE_MATERIALS | POSE_ALPHA |
                  POSE_SURFACES;
    }
    changes |= pose_dress(s->poses, s->pose.variant);
    follow_pose(s, changes);
    return fits;
}
