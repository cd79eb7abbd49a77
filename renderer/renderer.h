/* The renderer: one GL context, scenes resident in GPU memory, requests in, pixels out.
 * All calls come from the thread that created it. Never JSON, HTTP or sockets below this line. */
#pragma once
#include "protocol/result.h"
#include "protocol/technique_info.h"
#include "renderer/device.h"
#include "renderer/picture.h"

struct pen_renderer;

struct pen_renderer_config {
    struct pen_device_config device;
    uint64_t gpu_memory_bytes; /* budget for scenes, images, shadow inputs and targets; 0: 2 GiB */
    double session_idle_ms;    /* how long a session is kept that nobody uses; 0: a minute */
    uint32_t programs;         /* most compiled programs kept between frames; 0: 256 */
    /* Asked between two pieces of work; true ends the turn before its time. NULL: nobody is. */
    bool (*is_called)(void *context);
    void *call_context;
    bool as_gpu; /* goes the ways that are a GPU's, so that they can be tested without one */
};

/* Every registered method; usable without a renderer and without a GPU. */
const struct pen_catalogue *pen_renderer_catalogue(void);

/* Errors: PEN_UNAVAILABLE when there is no device of the asked kind. */
struct pen_renderer *pen_renderer_create(
    const struct pen_renderer_config *config, struct pen_error *error);
void pen_renderer_destroy(struct pen_renderer *renderer);
const struct pen_device_info *pen_renderer_device(const struct pen_renderer *renderer);

/* Makes a scene resident from its blob; a no-op when it is. May evict others (LRU) to stay in the
 * budget. Errors: PEN_INVALID for a bad blob, PEN_TOO_BIG when it can never fit. */
bool pen_renderer_load_scene(struct pen_renderer *renderer, const uint8_t id[PEN_ID_BYTES],
    int blob_fd, struct pen_error *error);
bool pen_renderer_has_scene(const struct pen_renderer *renderer, const uint8_t id[PEN_ID_BYTES]);
void pen_renderer_drop_scene(struct pen_renderer *renderer, const uint8_t id[PEN_ID_BYTES]);
uint64_t pen_renderer_gpu_bytes(const struct pen_renderer *renderer);
struct pen_program_counts pen_renderer_programs(const struct pen_renderer *renderer);

/* Emission images are one-image blobs (.pscene with one image and no geometry). */
bool pen_renderer_load_image(struct pen_renderer *renderer, const uint8_t id[PEN_ID_BYTES],
    int blob_fd, struct pen_error *error);
bool pen_renderer_has_image(const struct pen_renderer *renderer, const uint8_t id[PEN_ID_BYTES]);

/* Renders one checked request whose scene and images are resident. Fills the times, the completed
 * request and the warnings of *result (not queue, load and encode). PEN_INVALID: the request
 * asks what this scene does not have (camera 7 of 3). PEN_INTERNAL with a lost context: destroy. */
bool pen_renderer_render(struct pen_renderer *renderer, const struct pen_request *request,
    struct pen_frame *frame, struct pen_result *result, struct pen_error *error);
/* The same in pieces. Several may be in progress side by side; what is pointed at stays until the
 * end. `frame` and `result` are filled at the end. */
#define PEN_MAX_RENDERS 6
struct pen_render;
/* The blobs that a request needs: the scene's, then those of its images. */
struct pen_blobs {
    uint32_t count;
    const uint8_t *ids[1 + PEN_MAX_LIGHTS];
    int fds[1 + PEN_MAX_LIGHTS];
};
enum pen_admission {
    PEN_REFUSED, /* the error says why */
    PEN_LATER,   /* when something that is in progress has ended */
    PEN_ADMITTED /* may begin, now */
};
/* Makes resident what a request needs, all of it at once, beside what renders in progress use, and
 * sees to the room that its picture takes. LATER: the memory, a lane or the scene (in another pose)
 * is in use. Errors: as pen_renderer_load_scene; PEN_TOO_BIG: it would not fit alone. */
enum pen_admission pen_renderer_admit(struct pen_renderer *renderer,
    const struct pen_request *request, const struct pen_blobs *blobs, struct pen_error *error);
/* NULL, with the error filled, when it cannot even begin. */
struct pen_render *pen_render_begin(struct pen_renderer *renderer,
    const struct pen_request *request, struct pen_frame *frame, struct pen_result *result,
    struct pen_error *error);
/* Shows pictures so far to the viewer; before the first pen_render_advance. */
void pen_render_watch(struct pen_render *render, const struct pen_viewer *viewer);
/* Ends with the picture reached when it has had the renderer for so many ms, or at a time of the
 * monotonic clock (ms); 0: no limit. Before the first pen_render_advance. */
void pen_render_limit(struct pen_render *render, double budget_ms, double until_ms);
/* Takes over the samples that a render of the same request, but for their number, has left, and leaves
 * its own as far as it gets. Before the first pen_render_advance. */
void pen_render_continue(struct pen_render *render);
/* Goes on for about so many ms, more where a piece cannot be cut. True when it has ended. */
bool pen_render_advance(struct pen_render *render, double ms);
struct pen_place pen_render_place(const struct pen_render *render);
/* As pen_renderer_render; one that has not ended gives up at once and fails with PEN_LOST. */
bool pen_render_end(struct pen_render *render, struct pen_error *error);
/* Forgets every shadow input and what cameras saw, so that the next render pays for its own. */
void pen_renderer_drop_shadows(struct pen_renderer *renderer);
void pen_renderer_drop_views(struct pen_renderer *renderer); /* the second alone */
/* As config.is_called says; false without it. */
bool pen_renderer_is_called(const struct pen_renderer *renderer);
/* Why nothing can be drawn any more, or relied upon: the process is then to be replaced. */
enum pen_loss {
    PEN_LOSS_NONE,
    PEN_LOSS_MEMORY, /* the device had none left, whoever has it */
    PEN_LOSS_OTHERS, /* the context, by the fault of another one */
    PEN_LOSS_OWN     /* the context */
};
enum pen_loss pen_renderer_loss(struct pen_renderer *renderer);

enum pen_warm_up {
    PEN_WARM_USUAL, /* what a request needs that leaves everything out */
    PEN_WARM_ALL    /* and every method with its defaults */
};
/* Compiles and runs programs in tiny pictures of built-in scenes, so that the first real request is
 * not slower than the tenth. The usual request's end early where somebody calls, who would wait for
 * what may not be his own. Returns the milliseconds it took. */
double pen_renderer_warm_up(struct pen_renderer *renderer, enum pen_warm_up how_much);
