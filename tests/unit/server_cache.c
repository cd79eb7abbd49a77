/* Pictures: what a memfd must be, tags, and the cache's order and budget. */
#include "server/store/result_cache.h"
#include "tests/unit/check.h"
#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

static int memfd(size_t bytes, int seals)
{
    int fd = memfd_create("test", MFD_CLOEXEC | MFD_ALLOW_SEALING);
    CHECK(ftruncate(fd, (off_t)bytes) == 0);
    CHECK(fcntl(fd, F_ADD_SEALS, seals) == 0);
    return fd;
}

static struct picture *make(uint32_t number, size_t bytes)
{
    struct pen_result result = {.image_bytes = bytes};
    char tag[PEN_ID_HEX + 1];
    uint8_t id[PEN_ID_BYTES] = {(uint8_t)number, (uint8_t)(number >> 8)};
    pen_id_to_hex(id, tag);
    int fd = memfd(bytes, F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_WRITE);
    struct picture *picture = picture_create(fd, &result, tag, NULL);
    close(fd);
    return picture;
}

static void test_handover(void)
{
    struct pen_result result = {.image_bytes = 100};
    const int all = F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_WRITE;
    struct {
        int seals;
        size_t bytes;
        bool good;
    } rows[] = {{all, 100, true}, {F_SEAL_GROW, 100, false}, {F_SEAL_SHRINK, 100, false},
        {all, 99, false}, {all, 0, false}};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct pen_error error = {0};
        char tag[PEN_ID_HEX + 1] = "t";
        int fd = memfd(rows[i].bytes, rows[i].seals);
        struct picture *picture = picture_create(fd, &result, tag, &error);
        CHECK((picture != NULL) == rows[i].good);
        CHECK((error.code == PEN_INTERNAL) == !rows[i].good);
        picture_release(picture);
        close(fd);
    }
}

static void test_tags(void)
{
    struct pen_request a = {.width = 3}, b = a;
    struct pen_device_info device = {.renderer = "one"}, other = {.renderer = "two"};
    char first[PEN_ID_HEX + 1], second[PEN_ID_HEX + 1];
    picture_tag(&a, &device, first);
    CHECK(strlen(first) == PEN_ID_HEX);
    b.delivery.deadline_ms = 5; /* no pixel depends on it */
    picture_tag(&b, &device, second);
    CHECK_STR(first, second);
    b.output.quality = 1; /* the last byte before delivery that counts */
    picture_tag(&b, &device, second);
    CHECK(strcmp(first, second));
    picture_tag(&a, &other, second);
    CHECK(strcmp(first, second));
    char build[PEN_ID_HEX + 1] = "another build";
    picture_set_build(build);
    picture_tag(&a, &device, second);
    CHECK(strcmp(first, second));
}

static void test_order_and_budget(void)
{
    struct picture *p[5];
    for (uint32_t i = 0; i < 5; i++)
        p[i] = make(i, 10000);
    size_t cost = picture_cost(p[0]);
    struct result_cache *cache = result_cache_create(3 * cost);
    for (int i = 0; i < 3; i++)
        CHECK(result_cache_put(cache, p[i]));
    struct picture *hit = result_cache_get(cache, p[0]->tag);
    CHECK(hit == p[0]); /* and so the newest */
    picture_release(hit);
    CHECK(result_cache_put(cache, p[3]));
    CHECK(result_cache_get(cache, p[1]->tag) == NULL);
    CHECK(result_cache_put(cache, p[3])); /* once more is not twice */
    struct result_cache_numbers n;
    result_cache_read(cache, &n);
    CHECK(n.count == 3 && n.bytes == 3 * cost && n.evictions == 1 && n.hits == 1 && n.misses == 1);
    struct picture *big = make(9, 100000);
    CHECK(!result_cache_put(cache, big));
    result_cache_read(cache, &n);
    CHECK(n.count == 3);
    CHECK(p[0]->references == 2 && p[1]->references == 1);
    result_cache_destroy(cache);
    for (int i = 0; i < 5; i++) {
        CHECK(p[i]->references == 1);
        picture_release(p[i]);
    }
    picture_release(big);
    cache = result_cache_create(0);
    big = make(1, 1);
    CHECK(!result_cache_put(cache, big));
    picture_release(big);
    result_cache_destroy(cache);
}

int main(void)
{
    test_handover();
    test_tags();
    test_order_and_budget();
    CHECK_DONE();
}
