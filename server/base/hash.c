#include "server/base/hash.h"
#include "protocol/memory.h"
#include <openssl/evp.h>
#include <stdlib.h>
#include <unistd.h>

#define PIECE (1u << 18)

struct hash {
    EVP_MD_CTX *context;
};

struct hash *hash_create(void)
{
    struct hash *hash = pen_alloc(1, sizeof *hash);
    hash->context = EVP_MD_CTX_new();
    if (!hash->context || EVP_DigestInit_ex(hash->context, EVP_sha256(), NULL) != 1)
        abort();
    return hash;
}

void hash_add(struct hash *hash, const void *data, size_t bytes)
{
    if (EVP_DigestUpdate(hash->context, data, bytes) != 1)
        abort();
}

void hash_finish(struct hash *hash, uint8_t digest[PEN_ID_BYTES])
{
    if (EVP_DigestFinal_ex(hash->context, digest, NULL) != 1)
        abort();
    hash_destroy(hash);
}

void hash_destroy(struct hash *hash)
{
    if (!hash)
        return;
    EVP_MD_CTX_free(hash->context);
    free(hash);
}

bool hash_file(int fd, uint8_t digest[PEN_ID_BYTES])
{
    struct hash *hash = hash_create();
    void *piece = pen_alloc(1, PIECE);
    off_t at = 0;
    ssize_t n;
    while ((n = pread(fd, piece, PIECE, at)) > 0) {
        hash_add(hash, piece, (size_t)n);
        at += n;
    }
    free(piece);
    hash_finish(hash, digest);
    return !n;
}
