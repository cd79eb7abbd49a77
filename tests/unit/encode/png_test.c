/* The PNG writer against libspng: every bit, sizes that are awkward,
 * metadata, determinism, speed. */
#include "tests/unit/check.h"
#include "tests/unit/encode/pattern.h"
#include <spng.h>
#include <time.h>

static const char *const attributes[] = {"technique=pcss", "note=two\nlines",
    "title=Schatten \xc3\xbc", "no equals sign", "=no key", " spaced=x", "empty="};
#define ATTRIBUTES 7

static struct pen_bytes encode(const struct pen_frame *frame, uint32_t bits)
{
    struct pen_output output = {.format = PEN_PNG, .bit_depth = bits};
    struct pen_bytes bytes;
    struct pen_error error = {0};
    CHECK(pen_encode(frame, &output, attributes, ATTRIBUTES, &bytes, &error));
    CHECK_STR(error.message, "");
    return bytes;
}

static void check_text(spng_ctx *ctx)
{
    struct spng_text text[8];
    uint32_t count = 0;
    CHECK(spng_get_text(ctx, NULL, &count) == 0);
    CHECK(count == 4);
    if (count != 4)
        return;
    CHECK(spng_get_text(ctx, text, &count) == 0);
    CHECK_STR(text[0].keyword, "technique");
    CHECK_STR(text[0].text, "pcss");
    CHECK_STR(text[1].text, "two\nlines");
    CHECK_STR(text[2].keyword, "title");
    CHECK_STR(text[2].text, "Schatten \xc3\xbc");
    CHECK(text[2].type == SPNG_ITXT && text[1].type == SPNG_TEXT);
    CHECK_STR(text[3].keyword, "empty");
    CHECK_STR(text[3].text, "");
}

static void round_trip(uint32_t width, uint32_t height, uint32_t channels, uint32_t bits)
{
    struct pen_frame frame = {.width = width, .height = height, .plane_count = 1};
    size_t pixels = (size_t)width * height;
    pattern_plane(&frame.planes[0], "beauty", bits == 16 ? PEN_PIXEL_RGBA32F : PEN_PIXEL_RGBA8,
        channels, pixels, false);
    struct pen_bytes bytes = encode(&frame, bits);
    spng_ctx *ctx = spng_ctx_new(0);
    spng_set_png_buffer(ctx, bytes.data, bytes.size);
    spng_set_crc_action(ctx, SPNG_CRC_ERROR, SPNG_CRC_ERROR);
    struct spng_ihdr header;
    CHECK(spng_get_ihdr(ctx, &header) == 0);
    CHECK(header.width == width && header.height == height && header.bit_depth == bits);
    uint8_t type = channels == 1   ? SPNG_COLOR_TYPE_GRAYSCALE
                   : channels == 3 ? SPNG_COLOR_TYPE_TRUECOLOR
                                   : SPNG_COLOR_TYPE_TRUECOLOR_ALPHA;
    CHECK(header.color_type == type);
    size_t size = 0;
    CHECK(spng_decoded_image_size(ctx, SPNG_FMT_PNG, &size) == 0);
    CHECK(size == pixels * channels * bits / 8);
    uint8_t *decoded = malloc(size);
    CHECK(spng_decode_image(ctx, decoded, size, SPNG_FMT_PNG, 0) == 0);
    CHECK(spng_decode_chunks(ctx) == 0);
    check_text(ctx);
    size_t wrong = 0;
    for (size_t i = 0; i < pixels; i++) {
        for (uint32_t c = 0; c < channels; c++) {
            if (bits == 8) {
                wrong += decoded[i * channels + c] != ((uint8_t *)frame.planes[0].data)[i * 4 + c];
                continue;
            }
            double value = ((float *)frame.planes[0].data)[i * 4 + c];
            double expected = isnan(value) || value < 0 ? 0 : value > 1 ? 65535 : value * 65535;
            wrong += ((uint16_t *)decoded)[i * channels + c] != (uint16_t)floor(expected + 0.5);
        }
    }
    CHECK(wrong == 0);
    free(decoded);
    spng_ctx_free(ctx);
    struct pen_bytes again = encode(&frame, bits);
    CHECK(again.size == bytes.size && !memcmp(again.data, bytes.data, bytes.size));
    pen_bytes_finish(&again);
    pen_bytes_finish(&bytes);
    pattern_finish(&frame);
}

/* Of processor time: what others do on the machine does not count. */
static double now_ms(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec * 1e3 + (double)t.tv_nsec * 1e-6;
}

/* What libspng's fastest compression takes for the same picture. */
static double libspng_ms(const struct pen_frame *frame)
{
    size_t pixels = (size_t)frame->width * frame->height, size;
    uint8_t *rgb = malloc(3 * pixels);
    for (size_t i = 0; i < pixels; i++)
        memcpy(rgb + 3 * i, (const uint8_t *)frame->planes[0].data + 4 * i, 3);
    double start = now_ms();
    spng_ctx *ctx = spng_ctx_new(SPNG_CTX_ENCODER);
    struct spng_ihdr header = {.width = frame->width,
        .height = frame->height,
        .bit_depth = 8,
        .color_type = SPNG_COLOR_TYPE_TRUECOLOR};
    spng_set_option(ctx, SPNG_ENCODE_TO_BUFFER, 1);
    spng_set_option(ctx, SPNG_IMG_COMPRESSION_LEVEL, 1);
    spng_set_ihdr(ctx, &header);
    CHECK(spng_encode_image(ctx, rgb, 3 * pixels, SPNG_FMT_PNG, SPNG_ENCODE_FINALIZE) == 0);
    int failed = 0;
    free(spng_get_png_buffer(ctx, &size, &failed));
    spng_ctx_free(ctx);
    free(rgb);
    CHECK(!failed);
    return now_ms() - start;
}

/* A picture that compresses like a rendered one: smooth gradients, an edge, a little noise. */
static void speed(void)
{
    struct pen_frame frame = {.width = 800, .height = 600, .plane_count = 1};
    pattern_plane(&frame.planes[0], "beauty", PEN_PIXEL_RGBA8, 3, 800 * 600, false);
    uint8_t *pixel = frame.planes[0].data;
    for (uint32_t y = 0; y < 600; y++) {
        for (uint32_t x = 0; x < 800; x++, pixel += 4) {
            double shade = 0.5 + 0.5 * tanh(((double)x - 400) / (10 + y * 0.2));
            pixel[0] = (uint8_t)(60 + 150 * shade);
            pixel[1] = (uint8_t)(50 + 140 * shade + (pattern_bits(y * 800 + x) & 1));
            pixel[2] = (uint8_t)(40 + 0.2 * y);
        }
    }
    double best = 1e9, theirs = 1e9;
    size_t size = 0;
    for (int i = 0; i < 20; i++) {
        theirs = fmin(theirs, libspng_ms(&frame));
        double start = now_ms();
        struct pen_bytes bytes = encode(&frame, 8);
        double took = now_ms() - start;
        best = took < best ? took : best;
        size = bytes.size;
        pen_bytes_finish(&bytes);
    }
    printf("PNG 800x600, 8 bit RGB: best of 20 %.2f ms (libspng %.2f), %zu bytes\n", best, theirs,
        size);
    CHECK(size < 800 * 600 * 3 / 4);
#if defined(__OPTIMIZE__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
    CHECK(best < 0.25 * theirs);
#endif
    pattern_finish(&frame);
}

int main(void)
{
    static const uint32_t sizes[][2] = {
        {1, 1}, {1, 8192}, {8191, 3}, {8192, 1}, {3, 2}, {333, 201}};
    for (size_t s = 0; s < sizeof sizes / sizeof *sizes; s++)
        for (uint32_t channels = 1; channels <= 4; channels += channels == 1 ? 2 : 1)
            for (uint32_t bits = 8; bits <= 16; bits += 8)
                round_trip(sizes[s][0], sizes[s][1], channels, bits);
    speed();
    CHECK_DONE();
}
