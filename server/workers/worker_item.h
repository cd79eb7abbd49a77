/* A finished frame, or one so far, on its way through the worker's encoder threads. */
#pragma once
#include "renderer/picture.h"
#include "server/workers/channel.h"

struct worker_item { /* allocated by the caller, freed by the encoder */
    struct worker_item *next;
    struct channel_message
        message; /* CHANNEL_DONE or CHANNEL_PART; with an error there is no frame */
    struct pen_output output;
    uint32_t measure; /* enum measure */
    int reference_fd; /* planes to compare with, the item's own; -1: none */
    struct pen_frame frame;
    float load_ms;
    bool was_resident;
    uint64_t best_until_ns; /* monotonic: what there is then is wanted; 0: the whole picture is */
    bool fresh;             /* see channel_job */
    bool part_wanted;       /* a picture so far would be taken */
};

/* Nothing of it was there when it was wanted. */
void worker_item_refuse_late(struct worker_item *item);

struct pen_bytes;
/* Adds the bytes to the answer's descriptors, as a memfd that nobody can change any more. */
bool worker_item_hand_over(
    const struct pen_bytes *bytes, struct channel_fds *fds, struct pen_error *error);
