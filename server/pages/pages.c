#include "server/pages/pages.h"
#include "protocol/memory.h"
#include "protocol/request.h"
#include "server/base/hash.h"
#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <zlib.h>

#define EMBED(symbol, file)                                                                        \
    __asm__(".section .rodata\n.global " #symbol "\n.global " #symbol "_end\n" #symbol             \
            ":\n.incbin \"" file "\"\n" #symbol "_end:\n.byte 0\n.previous\n");

#define PAGE(symbol, type, path, folder, file)                                                     \
    EMBED(page_##symbol, folder file)                                                              \
    extern const char page_##symbol[], page_##symbol##_end[];
#include "server/pages/pages.def"

enum {
#define PAGE(symbol, ...) NUMBER_##symbol,
#include "server/pages/pages.def"
    PAGES
};

const char *const page_mime[] = {[PAGE_HTML] = "text/html; charset=utf-8",
    [PAGE_MODULE] = "text/javascript; charset=utf-8",
    [PAGE_STYLE] = "text/css; charset=utf-8",
    [PAGE_JSON] = "application/json"};

static struct page_file files[PAGES] = {
#define PAGE(symbol, type_, path_, ...)                                                            \
    {.type = PAGE_##type_, .path = path_, .plain.data = page_##symbol},
#include "server/pages/pages.def"
};

static void tag(struct page_bytes *file)
{
    uint8_t digest[PEN_ID_BYTES];
    struct hash *hash = hash_create();
    hash_add(hash, file->data, file->bytes);
    hash_finish(hash, digest);
    pen_id_to_hex(digest, file->tag);
}

/* As gzip (RFC 1952). */
static void squeeze(struct page_file *file)
{
    z_stream z = {0};
    if (deflateInit2(&z, Z_BEST_COMPRESSION, Z_DEFLATED, MAX_WBITS + 16, 8, Z_DEFAULT_STRATEGY) !=
        Z_OK)
        abort();
    uLong most = deflateBound(&z, file->plain.bytes);
    void *data = pen_alloc_zero(most, 1);
    z.next_in = (void *)(uintptr_t)file->plain.data;
    z.avail_in = (uInt)file->plain.bytes;
    z.next_out = data;
    z.avail_out = (uInt)most;
    deflate(&z, Z_FINISH);
    file->gzip.data = data;
    file->gzip.bytes = z.total_out;
    deflateEnd(&z);
}

static void complete(struct page_file *file)
{
    squeeze(file);
    tag(&file->plain);
    tag(&file->gzip);
}

void pages_make(struct page_file *file, enum page_type type, char *text)
{
    *file = (struct page_file){.type = type, .plain = {.data = text, .bytes = strlen(text)}};
    complete(file);
}

void pages_unmake(struct page_file *file)
{
    free((void *)(uintptr_t)file->plain.data);
    free((void *)(uintptr_t)file->gzip.data);
}

static void prepare(void)
{
    const char *const ends[] = {
#define PAGE(symbol, ...) page_##symbol##_end,
#include "server/pages/pages.def"
    };
    for (int i = 0; i < PAGES; i++) {
        files[i].plain.bytes = (size_t)(ends[i] - (const char *)files[i].plain.data);
        complete(&files[i]);
    }
}

const struct page_file *pages_find(const char *path)
{
    static pthread_once_t once = PTHREAD_ONCE_INIT;
    pthread_once(&once, prepare);
    for (int i = 0; i < PAGES; i++)
        if (!strcmp(files[i].path, path))
            return &files[i];
    return NULL;
}
