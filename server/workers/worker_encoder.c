#include "server/workers/worker_encoder.h"
#include "protocol/memory.h"
#include "renderer/encode/encode.h"
#include "server/base/clock.h"
#include "server/workers/worker_measure.h"
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <unistd.h>

#define THREADS 2

struct worker_encoder {
    pthread_mutex_t lock; /* guards first, last and stopping */
    pthread_cond_t work;
    struct worker_item *first, *last;
    bool stopping;
    int socket;
    pthread_t threads[THREADS];
};

static bool encode_picture(
    const struct worker_item *item, struct pen_result *result, struct channel_fds *fds)
{
    char scene[PEN_ID_HEX + 1], attributes[4][PEN_ID_HEX + 96];
    pen_id_to_hex(result->completed.scene, scene);
    snprintf(attributes[0], sizeof attributes[0], "Software=penumbra %s", PENUMBRA_VERSION);
    snprintf(attributes[1], sizeof attributes[1], "penumbra:scene=%s", scene);
    snprintf(attributes[2], sizeof attributes[2], "penumbra:technique=%.31s",
        result->completed.technique);
    snprintf(
        attributes[3], sizeof attributes[3], "penumbra:renderer=%.127s", result->device.renderer);
    const char *list[] = {attributes[0], attributes[1], attributes[2], attributes[3]};
    struct pen_bytes bytes = {0};
    bool ok = pen_encode(&item->frame, &item->output, list, 4, &bytes, &result->error) &&
              worker_item_hand_over(&bytes, fds, &result->error);
    result->image_bytes = bytes.size;
    pen_bytes_finish(&bytes);
    return ok;
}

static void encode(struct worker_encoder *encoder, struct worker_item *item)
{
    struct pen_result *result = &item->message.result;
    struct channel_fds fds = {0};
    if (result->error.code == PEN_OK) {
        uint64_t start = clock_now_ns();
        bool ok = item->measure == MEASURE_PICTURE ? encode_picture(item, result, &fds)
                                                   : worker_measure(item, &fds);
        if (!ok && result->error.code == PEN_OK)
            pen_fail(&result->error, PEN_INTERNAL, "", "The image could not be encoded.");
        result->stage_ms[PEN_STAGE_ENCODE] = (float)clock_ms(clock_now_ns() - start);
        if (!ok)
            channel_close_fds(&fds);
    }
    if (item->reference_fd >= 0)
        close(item->reference_fd);
    pen_frame_finish(&item->frame);
    channel_send(encoder->socket, &item->message, &fds); /* a daemon that left needs no answer */
    channel_close_fds(&fds);
    free(item);
}

static void *run(void *argument)
{
    struct worker_encoder *encoder = argument;
    for (;;) {
        pthread_mutex_lock(&encoder->lock);
        while (!encoder->first && !encoder->stopping)
            pthread_cond_wait(&encoder->work, &encoder->lock);
        struct worker_item *item = encoder->first;
        if (item && !(encoder->first = item->next))
            encoder->last = NULL;
        pthread_mutex_unlock(&encoder->lock);
        if (!item)
            return NULL;
        encode(encoder, item);
    }
}

struct worker_encoder *worker_encoder_create(int socket)
{
    struct worker_encoder *encoder = pen_alloc_zero(1, sizeof *encoder);
    encoder->socket = socket;
    pthread_mutex_init(&encoder->lock, NULL);
    pthread_cond_init(&encoder->work, NULL);
    for (int i = 0; i < THREADS; i++)
        if (pthread_create(&encoder->threads[i], NULL, run, encoder))
            abort();
    return encoder;
}

void worker_encoder_submit(struct worker_encoder *encoder, struct worker_item *item)
{
    item->next = NULL;
    pthread_mutex_lock(&encoder->lock);
    if (encoder->last)
        encoder->last->next = item;
    else
        encoder->first = item;
    encoder->last = item;
    pthread_cond_signal(&encoder->work);
    pthread_mutex_unlock(&encoder->lock);
}

void worker_encoder_destroy(struct worker_encoder *encoder)
{
    if (!encoder)
        return;
    pthread_mutex_lock(&encoder->lock);
    encoder->stopping = true;
    pthread_cond_broadcast(&encoder->work);
    pthread_mutex_unlock(&encoder->lock);
    for (int i = 0; i < THREADS; i++)
        pthread_join(encoder->threads[i], NULL);
    pthread_mutex_destroy(&encoder->lock);
    pthread_cond_destroy(&encoder->work);
    free(encoder);
}
