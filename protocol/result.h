/* What comes back with an image: how it was made and what every pass cost. No pointers. */
#pragma once
#include "protocol/request.h"

enum pen_stage {
    PEN_STAGE_QUEUE,
    PEN_STAGE_LOAD, /* scene and images into GPU memory */
    PEN_STAGE_GBUFFER,
    PEN_STAGE_SHADOW,    /* shadow inputs: depth maps, pyramids, SATs */
    PEN_STAGE_TECHNIQUE, /* the method's own screen passes */
    PEN_STAGE_SHADE,
    PEN_STAGE_READBACK,
    PEN_STAGE_ENCODE,
    PEN_STAGES
};
extern const char *const pen_stage_names[];

struct pen_pass_time {
    char name[24];
    uint32_t stage; /* enum pen_stage */
    uint32_t count; /* how often it ran for this image */
    float ms;       /* GPU time (software GL: wall clock between finishes), summed */
};

struct pen_device_info {
    char renderer[128]; /* GL_RENDERER */
    char version[96];   /* GL_VERSION */
    char platform[32];  /* "egl-device", "egl-surfaceless", "osmesa" */
    uint32_t software;  /* 1: no GPU behind it */
};

/* Compiled shader programs of a renderer, since it started. */
struct pen_program_counts {
    uint64_t bytes; /* of those kept; estimated from their texts */
    uint32_t kept, compiled, evicted;
    uint32_t reserved;
};

/* How far a picture is from its reference; see renderer/metrics/metrics.h. */
struct pen_comparison {
    double rmse, penumbra_rmse, mean_error, largest; /* of the mean visibility */
    double channel_rmse[3];                          /* of the coloured visibility: r, g, b */
    /* Of the display picture; contrast: SSIM's second factor. */
    double picture_rmse, ssim, ssim_contrast, flip;
    uint64_t penumbra_pixels; /* 0.02 < reference < 0.98 */
};

/* Where a render is, for logs. */
struct pen_place {
    uint32_t turn;  /* how many it has had */
    uint32_t frame; /* jittered, from 0 */
    uint32_t light; /* of the frame, from 0 */
    char pass[24];  /* the last that began, or "" */
};

/* How far a picture got; done == total: as far as it goes. */
struct pen_progress {
    uint32_t number;      /* of the render's pictures, from 0; the last one counts too */
    uint32_t done, total; /* light samples of a pixel, over jittered frames; a method that takes its
                             samples at once counts frames */
    uint32_t kept;        /* of those done, that an earlier render had taken */
    float standard_error; /* of the mean visibility: root mean square over the picture; < 0: nobody
                             estimated it */
    float elapsed_ms;     /* since the renderer began with it */
};

struct pen_result {
    struct pen_error error;       /* PEN_OK: there is an image */
    struct pen_request completed; /* camera and lights resolved, modes LOOK_AT / given */
    struct pen_device_info device;
    uint32_t warning_count;
    char warnings[PEN_MAX_WARNINGS][192];
    float stage_ms[PEN_STAGES];
    uint32_t pass_count;
    struct pen_pass_time passes[PEN_MAX_PASSES];
    uint32_t scene_was_resident;
    uint32_t shadow_inputs_reused;
    /* Over all lights and jittered frames, and only pixels that show a surface: */
    uint32_t class_pixels[3];      /* proved lit, undecided, in umbra; all 0 when not classified */
    uint32_t full_work_pixels;     /* for which the method ran in full */
    uint32_t subdivided_pixels[2]; /* filter split once, twice */
    uint32_t triangles_drawn;
    uint32_t shadow_maps;    /* depth maps of light samples that the image rests on, drawn or kept;
                             summed over lights and jittered frames */
    uint32_t history_frames; /* of the session, that the image rests on besides itself */
    float history_share;     /* of its receivers, over all lights and jittered frames: of which the
                                frame before knew something */
    uint64_t rays;           /* of methods that trace */
    uint64_t gpu_bytes;      /* resident scenes, images and shadow inputs */
    uint64_t image_bytes;    /* encoded size */
    struct pen_progress progress;
    double estimate_ms; /* what it was expected to take of the renderer; < 0: nothing was known */
    double turns_ms;    /* that it had the renderer for itself, one turn after the other */
    struct pen_program_counts programs;
    struct pen_comparison comparison; /* all 0 unless a reference was given */
};
/* Ends the texts of what another process reported. */
void pen_device_receive(struct pen_device_info *device);
/* Of one that another process reported: whether it can be read and printed safely, whatever its
 * numbers say. Its error is made safe (pen_error_receive). */
bool pen_result_receive(struct pen_result *result, const struct pen_catalogue *catalogue);
void pen_result_warn(struct pen_result *result, const char *format, ...)
    __attribute__((format(printf, 2, 3)));
