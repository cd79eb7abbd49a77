/* A finished image with its record. Immutable and reference-counted: the cache, several waiting
 * clients and the connections that are sending it share one. */
#pragma once
#include "protocol/result.h"
#include <stddef.h>

struct picture {
    const uint8_t *data; /* the encoded file: a mapping of the worker's sealed memfd */
    size_t size;
    char tag[PEN_ID_HEX + 1]; /* its ETag without quotes, and its name under /v1/results/ */
    struct pen_result result;
    unsigned references; /* atomic */
};

/* Maps the memfd (which stays the caller's). Without a tag the bytes' own hash is taken.
 * Errors: PEN_INTERNAL when it is not sealed or not as long as the record says. The caller
 * owns one reference. */
struct picture *picture_create(
    int memfd, const struct pen_result *result, const char *tag, struct pen_error *error);
struct picture *picture_reference(struct picture *picture);
void picture_release(struct picture *picture); /* NULL is fine */
/* What it costs to keep, in bytes. */
size_t picture_cost(const struct picture *picture);

/* Names the program that makes the pixels: a new build gives new tags. Before the first thread. */
void picture_set_build(const char text[PEN_ID_HEX + 1]);
const char *picture_build(void);
/* The strong ETag of what a request gives on a device: build, device and key bytes, hashed. */
void picture_tag(const struct pen_request *request, const struct pen_device_info *device,
    char tag[PEN_ID_HEX + 1]);
/* How much of its samples a picture has that had to end early; else, and of NULL, 1. */
double picture_share(const struct pen_result *result);
/* What of a scene's residency, pose and shadow inputs another render can use again: equal numbers. */
uint64_t picture_place(const struct pen_request *request);
/* SHA-256 of the request's key bytes. */
void picture_key(const struct pen_request *request, uint8_t key[PEN_ID_BYTES]);
