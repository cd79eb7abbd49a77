#include "server/store/picture.h"
#include "protocol/fnv.h"
#include "server/base/hash.h"
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>

static char build[PEN_ID_HEX + 1]; /* set once, before the first thread */

void picture_set_build(const char text[PEN_ID_HEX + 1])
{
    memcpy(build, text, sizeof build);
}

const char *picture_build(void)
{
    return build;
}

static void hash_bytes(const void *data, size_t size, char tag[PEN_ID_HEX + 1])
{
    struct hash *hash = hash_create();
    uint8_t digest[PEN_ID_BYTES];
    hash_add(hash, data, size);
    hash_finish(hash, digest);
    pen_id_to_hex(digest, tag);
}

struct picture *picture_create(
    int memfd, const struct pen_result *result, const char *tag, struct pen_error *error)
{
    const int needed = F_SEAL_SHRINK | F_SEAL_WRITE;
    struct stat status;
    if ((fcntl(memfd, F_GET_SEALS) & needed) != needed || fstat(memfd, &status) ||
        status.st_size <= 0 || (uint64_t)status.st_size != result->image_bytes) {
        pen_fail(error, PEN_INTERNAL, "", "The worker handed over a damaged image.");
        return NULL;
    }
    size_t size = (size_t)status.st_size;
    void *data = mmap(NULL, size, PROT_READ, MAP_SHARED, memfd, 0);
    struct picture *picture = calloc(1, sizeof *picture);
    if (data == MAP_FAILED || !picture) {
        if (data != MAP_FAILED)
            munmap(data, size);
        free(picture);
        pen_fail(error, PEN_UNAVAILABLE, "", "The service is out of memory.");
        return NULL;
    }
    picture->data = data;
    picture->size = size;
    picture->result = *result;
    if (tag)
        memcpy(picture->tag, tag, sizeof picture->tag);
    else
        hash_bytes(data, size, picture->tag);
    picture->references = 1;
    return picture;
}

struct picture *picture_reference(struct picture *picture)
{
    __atomic_add_fetch(&picture->references, 1, __ATOMIC_RELAXED);
    return picture;
}

void picture_release(struct picture *picture)
{
    if (!picture || __atomic_sub_fetch(&picture->references, 1, __ATOMIC_ACQ_REL))
        return;
    munmap((void *)picture->data, picture->size);
    free(picture);
}

size_t picture_cost(const struct picture *picture)
{
    return ((picture->size + 4095) & ~(size_t)4095) + sizeof *picture;
}

void picture_tag(const struct pen_request *request, const struct pen_device_info *device,
    char tag[PEN_ID_HEX + 1])
{
    struct hash *hash = hash_create();
    hash_add(hash, build, sizeof build);
    hash_add(hash, device->renderer, strnlen(device->renderer, sizeof device->renderer));
    hash_add(hash, "", 1);
    hash_add(hash, device->version, strnlen(device->version, sizeof device->version));
    hash_add(hash, "", 1);
    hash_add(hash, device->platform, strnlen(device->platform, sizeof device->platform));
    hash_add(hash, "", 1);
    hash_add(hash, request, PEN_REQUEST_KEY_BYTES);
    uint8_t digest[PEN_ID_BYTES];
    hash_finish(hash, digest);
    pen_id_to_hex(digest, tag);
}

void picture_key(const struct pen_request *request, uint8_t key[PEN_ID_BYTES])
{
    struct hash *hash = hash_create();
    hash_add(hash, request, PEN_REQUEST_KEY_BYTES);
    hash_finish(hash, key);
}

uint64_t picture_place(const struct pen_request *r)
{
    uint64_t place = pen_fnv(PEN_FNV_START, r->scene, sizeof r->scene);
    place = pen_fnv(place, r->animation, sizeof r->animation);
    place = pen_fnv(place, r->variant, sizeof r->variant);
    place = pen_fnv(place, &r->time_s, sizeof r->time_s);
    return pen_fnv(place, r->lights, (r->lights_given ? r->light_count : 0) * sizeof *r->lights);
}

double picture_share(const struct pen_result *result)
{
    const struct pen_progress *p = result ? &result->progress : NULL;
    return p && p->done && p->done < p->total ? (double)p->done / p->total : 1;
}
