/* The encoder threads of penumbra-worker: frames in, answers out. */
#pragma once
#include "server/workers/worker_item.h"

struct worker_encoder;
struct worker_encoder *worker_encoder_create(int socket);
void worker_encoder_submit(struct worker_encoder *encoder, struct worker_item *item);
/* Finishes what was submitted, then stops. */
void worker_encoder_destroy(struct worker_encoder *encoder);
