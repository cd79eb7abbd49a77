#include "protocol/memory.h"
#include "renderer/import/base/budget.h"
#include "renderer/import/convert/context.h"
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

static uint32_t image_slot(struct imp_context *context, uint32_t image, bool srgb)
{
    for (uint32_t i = 0; i < context->image_slot_count; i++)
        if (context->image_slots[i].image == image && context->image_slots[i].srgb == srgb)
            return i;
    context->image_slots[context->image_slot_count] = (struct imp_image_slot){image, srgb};
    return context->image_slot_count++;
}

int32_t imp_texture(struct imp_context *context, int32_t number, bool srgb)
{
    if (number < 0 || (uint32_t)number >= context->model->texture_count)
        return -1;
    const struct gltf_texture *from = &context->model->textures[number];
    if (from->image < 0 || (uint32_t)from->image >= context->document->image_count) {
        imp_warn(context, "A texture without a PNG, JPEG or WebP image is left out.");
        return -1;
    }
    uint32_t *known = &context->textures[2 * number + srgb];
    if (*known == IMP_NOT_YET) {
        const struct gltf_sampler usual = {-1, -1, 0, 0};
        const struct gltf_sampler *sampler =
            from->sampler >= 0 && (uint32_t)from->sampler < context->model->sampler_count
                ? &context->model->samplers[from->sampler]
                : &usual;
        const struct psc_texture to = {.image = image_slot(context, (uint32_t)from->image, srgb),
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
};

static uint64_t planned_pixels(const struct plan *plan)
{
    uint64_t w = plan->width >> plan->halvings, h = plan->height >> plan->halvings;
    return (w ? w : 1) * (h ? h : 1);
}

/* The message of an image's decoder, with the image's place in the document. */
static bool image_fail(uint32_t image, const struct pen_error *why, struct pen_error *error)
{
    char pointer[64];
    snprintf(pointer, sizeof pointer, "/images/%u", image);
    return pen_fail(error, why->code == PEN_TOO_BIG ? PEN_TOO_BIG : PEN_INVALID, pointer,
        "glTF %s: %s", pointer, why->message);
}

/* Reads every header, keeps to the budgets, and halves the largest images until all fit. */
static bool plan_images(struct imp_context *context, struct plan *plans, struct pen_error *error)
{
    uint64_t uploaded = 0, kept = 0;
    for (uint32_t i = 0; i < context->image_slot_count; i++) {
        struct plan *plan = &plans[i];
        uint32_t number = context->image_slots[i].image;
        const struct imp_image *image = &context->document->images[number];
        struct pen_error why = {0};
        if (!imp_image_header(image->data, &plan->width, &plan->height, &why))
            return image_fail(number, &why, error);
        const char *mime = imp_image_mime(imp_image_sniff(image->data));
        if (image->mime[0] && strcasecmp(image->mime, mime) &&
            strcasecmp(image->mime, "application/octet-stream"))
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

bool imp_add_images(struct imp_context *context, struct pen_error *error)
{
    struct plan *plans = pen_alloc_zero(context->image_slot_count, sizeof *plans);
    bool done = plan_images(context, plans, error);
    for (uint32_t i = 0; done && i < context->image_slot_count; i++) {
        const struct imp_image_slot *slot = &context->image_slots[i];
        uint32_t width = plans[i].width, height = plans[i].height;
        struct pen_error why = {0};
        uint8_t *rgba;
        bool damaged;
        done = imp_image_decode(
            context->document->images[slot->image].data, width, height, &rgba, &damaged, &why);
        if (!done) {
            image_fail(slot->image, &why, error);
            break;
        }
        if (damaged)
            imp_warn(context, "Image %u is damaged; parts of it may be missing.", slot->image);
        for (uint32_t k = 0; k < plans[i].halvings; k++)
            imp_image_halve(rgba, &width, &height, slot->srgb);
        if (plans[i].halvings)
            imp_warn(context, "Image %u was reduced from %u x %u to %u x %u pixels.", slot->image,
                plans[i].width, plans[i].height, width, height);
        psc_builder_add_image(context->builder, width, height, slot->srgb, rgba);
        free(rgba);
    }
    free(plans);
    return done;
}
