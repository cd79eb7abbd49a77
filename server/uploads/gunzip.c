#include "server/uploads/gunzip.h"
#include "protocol/memory.h"
#include <stdlib.h>
#include <zlib.h>

#define GZIP_ONLY (16 + MAX_WBITS) /* as inflateInit2 wants it */
#define PIECE_BYTES (64u << 10)

struct gunzip {
    z_stream stream;
    bool over;
    unsigned char piece[PIECE_BYTES];
};

struct gunzip *gunzip_create(void)
{
    struct gunzip *g = pen_alloc_zero(1, sizeof *g);
    if (inflateInit2(&g->stream, GZIP_ONLY) != Z_OK)
        abort();
    return g;
}

void gunzip_destroy(struct gunzip *g)
{
    if (!g)
        return;
    inflateEnd(&g->stream);
    free(g);
}

bool gunzip_add(struct gunzip *g, const void *data, size_t bytes,
    bool (*take)(void *context, const void *data, size_t bytes, struct pen_error *error),
    void *context, struct pen_error *error)
{
    z_stream *stream = &g->stream;
    stream->next_in = (unsigned char *)data;
    stream->avail_in = (uInt)bytes;
    do {
        if (g->over)
            return !stream->avail_in ||
                   pen_fail(error, PEN_MALFORMED, "", "Something follows the gzip of the body.");
        stream->next_out = g->piece;
        stream->avail_out = PIECE_BYTES;
        int result = inflate(stream, Z_NO_FLUSH);
        if (result != Z_OK && result != Z_STREAM_END && result != Z_BUF_ERROR)
            return pen_fail(
                error, PEN_MALFORMED, "", "The body is no gzip, as Content-Encoding says.");
        g->over = result == Z_STREAM_END;
        size_t got = PIECE_BYTES - stream->avail_out;
        if (got && !take(context, g->piece, got, error))
            return false;
    } while (stream->avail_in || !stream->avail_out);
    return true;
}

bool gunzip_end(const struct gunzip *g, struct pen_error *error)
{
    return g->over || pen_fail(error, PEN_MALFORMED, "", "The gzip of the body is not complete.");
}
