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
#define ATTRIBUTES 8

struct worker_encoder {
    pthread_mutex_t lock; /* guards first, last, stopping and each member's part */
    pthread_cond_t work, part_sent;
    struct worker_item *first, *last;
    bool stopping;
    int socket;
    struct member {
        struct worker_encoder *encoder;
        pthread_t thread;
        uint64_t part; /* the job whose picture so far it is encoding; 0: none */
    } members[THREADS];
};

static bool encode_picture(
    const struct worker_item *item, struct pen_result *result, struct channel_fds *fds)
{
    char scene[PEN_ID_HEX + 1], attributes[ATTRIBUTES][PEN_ID_HEX + 96];
    const struct pen_progress *progress = &result->progress;
    uint32_t count = 4;
    pen_id_to_hex(result->completed.scene, scene);
    snprintf(attributes[0], sizeof attributes[0], "Software=penumbra %s", PENUMBRA_VERSION);
    snprintf(attributes[1], sizeof attributes[1], "penumbra:scene=%s", scene);
    snprintf(attributes[2], sizeof attributes[2], "penumbra:technique=%.31s",
        result->completed.technique);
    snprintf(
        attributes[3], sizeof attributes[3], "penumbra:renderer=%.127s", result->device.renderer);
    if (progress->done < progress->total) {
        snprintf(attributes[count++], sizeof *attributes, "penumbra:samples=%u", progress->done);
        snprintf(attributes[count++], sizeof *attributes, "penumbra:of=%u", progress->total);
        snprintf(attributes[count++], sizeof *attributes, "penumbra:elapsed_ms=%.1f",
            (double)progress->elapsed_ms);
        if (progress->standard_error >= 0)
            snprintf(attributes[count++], sizeof *attributes, "penumbra:standard_error=%.3g",
                (double)progress->standard_error);
    }
    const char *list[ATTRIBUTES];
    for (uint32_t i = 0; i < count; i++)
        list[i] = attributes[i];
    struct pen_bytes bytes = {0};
    bool ok = pen_encode(&item->frame, &item->output, list, count, &bytes, &result->error) &&
              worker_item_hand_over(&bytes, fds, &result->error);
    result->image_bytes = bytes.size;
    pen_bytes_finish(&bytes);
    return ok;
}

/* The other thread may still be at a picture so far of the same job; that goes first. */
static void wait_for_part(struct worker_encoder *encoder, uint64_t job)
{
    pthread_mutex_lock(&encoder->lock);
    for (int i = 0; i < THREADS; i++)
        while (encoder->members[i].part == job)
            pthread_cond_wait(&encoder->part_sent, &encoder->lock);
    pthread_mutex_unlock(&encoder->lock);
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
    if (item->message.kind == CHANNEL_DONE)
        wait_for_part(encoder, item->message.job);
    if (item->message.kind == CHANNEL_DONE || result->error.code == PEN_OK)
        channel_send(
            encoder->socket, &item->message, &fds); /* a daemon that left needs no answer */
    channel_close_fds(&fds);
    free(item);
}

static void *run(void *argument)
{
    struct member *member = argument;
    struct worker_encoder *encoder = member->encoder;
    for (;;) {
        pthread_mutex_lock(&encoder->lock);
        while (!encoder->first && !encoder->stopping)
            pthread_cond_wait(&encoder->work, &encoder->lock);
        struct worker_item *item = encoder->first;
        if (item && !(encoder->first = item->next))
            encoder->last = NULL;
        if (item && item->message.kind == CHANNEL_PART)
            member->part = item->message.job;
        pthread_mutex_unlock(&encoder->lock);
        if (!item)
            return NULL;
        encode(encoder, item);
        pthread_mutex_lock(&encoder->lock);
        member->part = 0;
        pthread_cond_broadcast(&encoder->part_sent);
        pthread_mutex_unlock(&encoder->lock);
    }
}

struct worker_encoder *worker_encoder_create(int socket)
{
    struct worker_encoder *encoder = pen_alloc_zero(1, sizeof *encoder);
    encoder->socket = socket;
    pthread_mutex_init(&encoder->lock, NULL);
    pthread_cond_init(&encoder->work, NULL);
    pthread_cond_init(&encoder->part_sent, NULL);
    for (int i = 0; i < THREADS; i++) {
        encoder->members[i].encoder = encoder;
        if (pthread_create(&encoder->members[i].thread, NULL, run, &encoder->members[i]))
            abort();
    }
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
        pthread_join(encoder->members[i].thread, NULL);
    pthread_mutex_destroy(&encoder->lock);
    pthread_cond_destroy(&encoder->work);
    pthread_cond_destroy(&encoder->part_sent);
    free(encoder);
}
