/* The contract between the frame and a shadow method: fill one visibility texture per light.
 *
 * vis, RGBA16F: rgb = mean over the light's area of emission x visibility; a = mean visibility
 * (1 = lit). A new method is one .c in renderer/techniques/, its .glsl, and a line in
 * registry.def. The words that its .glsl may use: renderer/shaders/README.md. */
#pragma once
#include "protocol/result.h"
#include "protocol/technique_info.h"
#include "renderer/gl/fiber.h"
#include "renderer/gl/program.h"
#include "renderer/gl/target.h"
#include "renderer/gl/timer.h"
#include "renderer/light/light.h"
#include "renderer/scene/scene.h"
#include "renderer/scene/view.h"

struct passes;
struct shadow_cache;
struct history;
struct history_store;
struct kept_sums;
struct kept_sums_store;

/* A piece of work that a software rasteriser has been given. */
struct technique_piece {
    GLsync fence; /* NULL: there is none */
    uint64_t kind;
    double units;   /* of technique_speed; < 0: it tells nothing of others */
    bool follows;   /* it begins when the one before ends */
    uint32_t waits; /* gl_waits when it was handed over */
    double away_ms; /* of technique_turns, then */
    struct gl_stopwatch since;
};

/* More than these are not handed over before the first of them is done. */
#define TECHNIQUE_PIECES 3

/* A frame in progress gives way to others between two pieces of work (passes/draw/turn.h). */
struct technique_turns {
    struct gl_fiber *fiber; /* NULL: it never does */
    double most_ms;         /* a turn should last at most so long */
    double since_ms;        /* when this one began; gl_now_ms */
    double piece_ms;        /* when the last piece was done, likewise */
    double used_ms;         /* that those before it took */
    uint32_t number;
    uint32_t frame, light; /* that it is at */
    bool cancelled;
    /* Beyond these the pass at hand is the last: of gl_now_ms, and of all turns together; 0: none. */
    double stop_ms, stop_used_ms;
    bool stopped; /* it was */
    bool held;    /* what is under way must not be interrupted */
    GLsync fence; /* of the last piece but one */
    struct technique_piece under_way[TECHNIQUE_PIECES]; /* the first one first */
    uint32_t pieces;
    /* Called before and after others have the turn; NULL: nothing goes on that should not then. */
    void (*away)(void *context, bool is);
    void *away_context;
    double away_ms;        /* between turns */
    uint64_t needed_bytes; /* what did not fit the budget came to, with all the rest; 0: it fits */
};

/* What a software rasteriser takes for a kind of work. */
#define TECHNIQUE_SPEEDS 256
struct technique_speed {
    uint64_t kind;
    double ms; /* per unit, a pixel or what cull_piece counts; 0: not known */
};

/* What a frame in progress has for itself, and what all of them share. There are as many as frames
 * that may be in progress side by side (renderer/lane.h), and they live as long as the context. */
struct technique_ctx {
    struct technique_turns turns;
    struct technique_speed *speeds;   /* TECHNIQUE_SPEEDS of them, shared */
    uint32_t lane;                    /* number of this one */
    bool (*is_called)(void *context); /* as pen_renderer_config has it */
    void *call_context;
    struct gl_programs *programs;
    struct gl_samplers samplers;
    struct gl_timer timer;
    struct shadow_cache *shadows;      /* inputs that are kept between requests */
    struct history_store *histories;   /* of sequences of frames */
    struct kept_sums_store *kept_sums; /* of renders, for those that ask for more */
    struct passes *passes;             /* what passes keep for themselves */
    bool software;                     /* OpenGL runs on the CPU */
    GLuint empty_array;                /* vertex array for passes that make their own vertices */
    /* Uniform buffers: UBO_VIEW, UBO_LIGHT and UBO_PARAMS. */
    GLuint view_block, light_block, param_block;
    GLuint counts;           /* STORAGE_COUNTS of the frame's method, or 0 */
    struct gl_texture white; /* 1 x 1, bound where a light has no emission texture */
    uint64_t gpu_memory;     /* the budget of everything, bytes */
    uint64_t shadow_memory;  /* bytes that kept shadow inputs of a frame may take together */
    uint64_t shadow_budget;  /* the share of one face of one light in it; set for every frame */
};

/* All that a drawing of it depends on; zeroed: nothing is known. */
struct gbuffer_view {
    uint8_t scene[PEN_ID_BYTES];
    uint32_t known, kind, ground, number, width, height;
    int32_t animation, variant;
    float time_s, world_to_clip[16], eye[3], ground_albedo[3];
};

struct gbuffer {
    struct gl_target depth;    /* D32F, reversed, 0: background */
    struct gl_target normal;   /* RGBA16: octahedral geometric normal, octahedral shading normal */
    struct gl_target albedo;   /* RGBA8: square root of albedo, flags */
    struct gl_target surface;  /* RGBA8: roughness, metallic, occlusion, specular scale */
    struct gl_target emission; /* R11G11B10F; only when the scene has any */
    GLuint framebuffer;        /* of all of them */
    struct gbuffer_view shown; /* what it holds, from frame to frame */
    uint64_t triangles;        /* that were drawn for it */
    uint32_t drawn;            /* how often */
};

/* What the frame does with an estimate that is not complete. */
enum technique_step {
    STEP_GO_ON,
    STEP_SHOW, /* it is to be seen */
    STEP_STOP, /* it is as good as it gets */
};
struct technique_run;
struct technique_watch {
    enum technique_step (*step)(struct technique_run *, uint32_t done, uint32_t total);
    bool (*show)(struct technique_run *, struct pen_error *);
};

/* One call of a method: one face of one light of one frame. */
struct technique_run {
    struct technique_ctx *ctx;
    struct scene *scene;
    const struct view *view;
    const struct gbuffer *gbuffer;
    const struct light *light;
    const struct light_face *face;
    const struct pen_request *request;
    const struct technique *technique;
    const void *params;     /* the method's own struct, also bound as UBO_PARAMS */
    void *state;            /* state_size bytes, zeroed when the renderer starts */
    GLuint vis_framebuffer; /* bound; pixels already 1; only this face's receivers may be written */
    const struct gl_texture *vis;      /* what that holds: the layer of light_index */
    const struct gl_texture *emission; /* of the light, with mips, or ctx->white */
    struct pen_result *result;         /* warnings and counts */
    uint32_t width, height;            /* px of vis and G-buffer */
    uint32_t frame;                    /* number of the jittered frame */
    uint32_t light_index;              /* of the request */
    struct technique_watch *watch;     /* see passes/draw/show.h; NULL: nobody asks */
    struct history *history;           /* of the sequence that the request goes on with, or NULL */
    struct kept_sums *sums;            /* see passes/draw/kept_sums.h; NULL: nothing is kept */
    /* R32F, or 0: nobody asks. A method that estimates its error adds the square of the standard
     * error of vis.a here, by blending. */
    GLuint variance_framebuffer;
    /* What record tells the frame: */
    uint32_t map_size; /* texels per side of the last map it looked at, fitted to all that casts; 0:
                          finer ones follow the view, or it has none */
    const struct gl_texture *tiles; /* classes, of pass_classify; NULL: not classified */
    struct {
        uint32_t map_size;    /* of the map that proves it; 0: the method's answer stands */
        float texels, pixels; /* how far beyond the light's image the method may look */
        uint32_t window;      /* enum bound_window */
        bool late;            /* vis is written with the last face of the light */
    } bound;                  /* what pass_bound may hold the answer to */
    bool work_counted; /* result->full_work_pixels has this light; else every receiver counts */
};

struct technique {
    struct pen_technique_info info;
    /* Its visibility already is the mean over the light above the receiver's horizon, faded as
     * horizon.glsl says; of the other methods pass_screen fades it. */
    bool counts_horizon;
    size_t state_size;
    /* Cheaper settings, "name=most name=most", of a method that has no steps (passes/draw/show.h): a
     * picture that must not be late begins with them. NULL: it has, or is cheap. */
    const char *sketch;
    bool keeps_sums;      /* goes on with what a request for fewer `samples` has left */
    bool estimates_error; /* fills technique_run.variance_framebuffer */
    bool (*create)(struct technique_ctx *, void *state, struct pen_error *); /* optional */
    bool (*record)(struct technique_run *, struct pen_error *);
    /* Optional: all frames of an image are recorded (or failed); counts go into the result. */
    void (*finish)(struct technique_ctx *, void *state, struct pen_result *);
    void (*destroy)(struct technique_ctx *, void *state); /* optional */
};

extern const struct technique *const technique_registry[]; /* NULL-terminated */
