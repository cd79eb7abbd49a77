/* The encoder threads of penumbra-worker: frames in, answers out. */
#pragma once
#include "renderer/renderer.h"
#include "server/channel.h"

struct worker_item { /* allocated by the caller, freed by the encoder */
    struct worker_item *next;
    struct channel_message message; /* CHANNEL_DONE; with an error there is no frame */
    struct pen_output output;
    struct pen_frame frame;
};

struct worker_encoder;
struct worker_encoder *worker_encoder_create(int socket);
void worker_encoder_submit(struct worker_encoder *encoder, struct worker_item *item);
/* Finishes what was submitted, then stops. */
void worker_encoder_destroy(struct worker_encoder *encoder);
