#include "renderer/import/convert/texture.h"
#include "protocol/memory.h"
#include "renderer/import/base/budget.h"
#include "renderer/import/image/image.h"
#include "renderer/import/base/text.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

enum {
    NEAREST = 9728,
    LINEAR,
    NEAREST_MIPMAP_NEAREST = 9984,
    LINEAR_MIPMAP_NEAREST,
    NEAREST_MIPMAP_LINEAR,
    LINEAR_MIPMAP_LINEAR
};
enum { CLAMP_TO_EDGE = 33071, MIRRORED_REPEAT = 33648 };
/* The bits of psc_texture.nearest. */
enum { NEAR_MAG = 1, NEAR_MIN = 2, NEAR_MIP = 4, NO_MIPS = 8 };

static uint32_t wrap(int32_t mode)
{
    return mode == CLAMP_TO_EDGE ? PSC_CLAMP : mode == MIRRORED_REPEAT ? PSC_MIRROR : PSC_REPEAT;
}

static uint32_t filters(const struct gltf_sampler *sampler)
{
    uint32_t bits = sampler->mag_filter == NEAREST ? NEAR_MAG : 0;
    switch (sampler->min_filter) {
    case NEAREST:
        return bits | NEAR_MIN | NO_MIPS;
    case LINEAR:
        return bits | NO_MIPS;
    case NEAREST_MIPMAP_NEAREST:
        return bits | NEAR_MIN | NEAR_MIP;
    case LINEAR_MIPMAP_NEAREST:
        return bits | NEAR_MIP;
    case NEAREST_MIPMAP_LINEAR:
        return bits | NEAR_MIN;
    }
    return bits;
}

static bool is_srgb(enum imp_role role)
{
    return role <= IMP_EMISSION;
}

/* What stands in for an image: white leaves the material's own colour, a surface is rough and no
 * metal (or reflects 4 %), a normal is the vertices', and nothing glows. */
static const uint8_t neutral[IMP_ROLES][4] = {[IMP_BASE] = {255, 255, 255, 255},
    [IMP_GLOSS] = {56, 56, 56, 128},
    [IMP_EMISSION] = {0, 0, 0, 255},
    [IMP_SURFACE] = {255, 255, 0, 255},
    [IMP_NORMAL] = {128, 128, 255, 255},
    [IMP_OCCLUSION] = {255, 255, 255, 255}};

static bool is_readable(const struct imp_context *context, uint32_t image)
{
    uint32_t width, height;
    return imp_image_header(context->document->images[image].data, &width, &height, NULL);
}

static uint32_t image_slot(struct imp_context *context, uint32_t image, enum imp_role role)
{
    bool readable = image != IMP_NOT_YET && is_readable(context, image);
    for (uint32_t i = 0; i < context->image_slot_count; i++) {
        const struct imp_image_slot *slot = &context->image_slots[i];
        if (slot->image == image &&
            (readable ? is_srgb(slot->role) == is_srgb(role) : slot->role == role))
            return i;
    }
    context->image_slots[context->image_slot_count] = (struct imp_image_slot){image, role};
    return context->image_slot_count++;
}

/* The first that can be read; when none can, the last, of which the warning tells. */
static uint32_t choose_image(const struct imp_context *context, const struct gltf_texture *from)
{
    uint32_t last = IMP_NOT_YET;
    for (int i = 0; i < GLTF_TEXTURE_SOURCES; i++) {
        uint32_t image = (uint32_t)from->images[i];
        if (image >= context->document->image_count)
            continue;
        last = image;
        if (is_readable(context, image))
            return image;
    }
    return last;
}

int32_t imp_texture(struct imp_context *context, int32_t number, enum imp_role role)
{
    if (number < 0 || (uint32_t)number >= context->model->texture_count)
        return -1;
    const struct gltf_texture *from = &context->model->textures[number];
    uint32_t image = choose_image(context, from);
    if (image == IMP_NOT_YET)
        imp_warn(context, "A texture without an image is drawn plain.");
    uint32_t *roles = &context->textures[IMP_ROLES * (uint32_t)number], *known = &roles[role];
    uint32_t slot = image_slot(context, image, role);
    for (int other = 0; *known == IMP_NOT_YET && other < IMP_ROLES; other++)
        if (roles[other] != IMP_NOT_YET && image_slot(context, image, other) == slot)
            *known = roles[other];
    if (*known == IMP_NOT_YET) {
        const struct gltf_sampler usual = {-1, -1, 0, 0};
        const struct gltf_sampler *sampler =
            from->sampler >= 0 && (uint32_t)from->sampler < context->model->sampler_count
                ? &context->model->samplers[from->sampler]
                : &usual;
        const struct psc_texture to = {.image = slot,
            .wrap_s = wrap(sampler->wrap_s),
            .wrap_t = wrap(sampler->wrap_t),
            .nearest = filters(sampler)};
        *known = psc_builder_add_texture(context->builder, &to);
    }
    return (int32_t)*known;
}

/* How an image will be added: its size as uploaded, halved so many times. */
struct plan {
    uint32_t width, height, halvings;
    bool plain; /* it cannot be decoded */
};

static uint64_t planned_pixels(const struct plan *plan)
{
    uint64_t w = plan->width >> plan->halvings, h = plan->height >> plan->halvings;
    return (w ? w : 1) * (h ? h : 1);
}

/* An image that is too big is refused, with its place in the document; one that cannot be decoded
 * is drawn plain. */
static bool go_on_without(struct imp_context *context, uint32_t image, const struct pen_error *why,
    struct plan *plan, struct pen_error *error)
{
    char pointer[64];
    snprintf(pointer, sizeof pointer, "/images/%u", image);
    if (why->code == PEN_TOO_BIG)
        return pen_fail(error, PEN_TOO_BIG, pointer, "glTF %s: %s", pointer, why->message);
    imp_warn(context, "Image %u is drawn plain. %s", image, why->message);
    *plan = (struct plan){1, 1, 0, true};
    return true;
}

/* Reads every header, keeps to the budgets, and halves the largest images until all fit. */
static bool plan_images(struct imp_context *context, struct plan *plans, struct pen_error *error)
{
    uint64_t uploaded = 0, kept = 0;
    for (uint32_t i = 0; i < context->image_slot_count; i++) {
        struct plan *plan = &plans[i];
        uint32_t number = context->image_slots[i].image;
        if (number == IMP_NOT_YET) {
            *plan = (struct plan){1, 1, 0, true};
            continue;
        }
        const struct imp_image *image = &context->document->images[number];
        struct pen_error why = {0};
        if (!imp_image_header(image->data, &plan->width, &plan->height, &why)) {
            if (!go_on_without(context, number, &why, plan, error))
                return false;
            continue;
        }
        const char *mime = imp_image_mime(imp_image_sniff(image->data));
        if (image->mime[0] && strcasecmp(image->mime, mime) &&
            strcasecmp(image->mime, "application/octet-stream") &&
            (strcasecmp(image->mime, "image/jpg") || strcmp(mime, "image/jpeg")))
            imp_warn(context, "Image %u is said to be %s, but is %s.", number,
                imp_text(image->mime).s, mime);
        uploaded += (uint64_t)plan->width * plan->height;
        if (uploaded > IMP_MAX_TOTAL_PIXELS)
            return pen_fail(error, PEN_TOO_BIG, "",
                "The glTF's images have more than %llu million pixels together.",
                IMP_MAX_TOTAL_PIXELS >> 20);
        while (plan->width >> plan->halvings > IMP_MAX_IMAGE_SIDE ||
               plan->height >> plan->halvings > IMP_MAX_IMAGE_SIDE)
            plan->halvings++;
        kept += planned_pixels(plan);
    }
    while (kept > IMP_KEEP_TOTAL_PIXELS) {
        struct plan *largest = plans;
        for (uint32_t i = 1; i < context->image_slot_count; i++)
            if (planned_pixels(&plans[i]) > planned_pixels(largest))
                largest = &plans[i];
        kept -= planned_pixels(largest);
        largest->halvings++;
        kept += planned_pixels(largest);
    }
    return true;
}

static bool add_image(struct imp_context *context, const struct imp_image_slot *slot,
    struct plan *plan, struct pen_error *error)
{
    uint32_t width = plan->width, height = plan->height;
    struct pen_error why = {0};
    uint8_t *rgba = NULL;
    bool damaged = false, srgb = is_srgb(slot->role);
    if (!plan->plain && !imp_image_decode(context->document->images[slot->image].data, width,
                            height, &rgba, &damaged, &why)) {
        if (!go_on_without(context, slot->image, &why, plan, error))
            return false;
        width = height = 1;
    }
    if (damaged)
        imp_warn(context, "Image %u is damaged; parts of it may be missing.", slot->image);
    for (uint32_t k = 0; k < plan->halvings; k++)
        imp_image_halve(rgba, &width, &height, srgb);
    if (plan->halvings)
        imp_warn(context, "Image %u was reduced from %u x %u to %u x %u pixels.", slot->image,
            plan->width, plan->height, width, height);
    psc_builder_add_image(
        context->builder, width, height, srgb, plan->plain ? neutral[slot->role] : rgba);
    free(rgba);
    return true;
}

bool imp_add_images(struct imp_context *context, struct pen_error *error)
{
    struct plan *plans = pen_alloc_zero(context->image_slot_count, sizeof *plans);
    bool done = plan_images(context, plans, error);
    for (uint32_t i = 0; done && i < context->image_slot_count; i++)
        done = add_image(context, &context->image_slots[i], &plans[i], error);
    free(plans);
    return done;
}
