/* JPEG and WebP against their own decoders, refusals, and four threads at once. */
#include "tests/unit/check.h"
#include "tests/unit/encode/pattern.h"
#include <dirent.h>
#include <pthread.h>
#include <turbojpeg.h>
#include <webp/decode.h>

static struct pen_bytes encode(
    const struct pen_frame *frame, uint32_t format, uint32_t bits, uint32_t quality)
{
    struct pen_output output = {.format = format, .bit_depth = bits, .quality = quality};
    static const char *const attributes[] = {"technique=pcss"};
    struct pen_bytes bytes;
    struct pen_error error = {0};
    CHECK(pen_encode(frame, &output, attributes, 1, &bytes, &error));
    CHECK_STR(error.message, "");
    return bytes;
}

/* A gradient, which lossy formats must keep closely; alpha falls with y. */
static void gradient(struct pen_frame *frame, uint32_t width, uint32_t height, uint32_t channels)
{
    *frame = (struct pen_frame){.width = width, .height = height, .plane_count = 1};
    pattern_plane(
        &frame->planes[0], "beauty", PEN_PIXEL_RGBA8, channels, (size_t)width * height, false);
    double across = fmin(200.0 / width, 3), down = fmin(100.0 / height, 3);
    uint8_t *p = frame->planes[0].data;
    for (uint32_t y = 0; y < height; y++)
        for (uint32_t x = 0; x < width; x++, p += 4) {
            p[0] = (uint8_t)(20 + across * x);
            p[1] = (uint8_t)(220 - down * y);
            p[2] = (uint8_t)(120 + 0.3 * across * x);
            p[3] = (uint8_t)(255 - down * y);
        }
}

static double worst(const struct pen_frame *frame, const uint8_t *decoded, uint32_t channels)
{
    double most = 0;
    const uint8_t *in = frame->planes[0].data;
    for (size_t i = 0; i < (size_t)frame->width * frame->height; i++)
        for (uint32_t c = 0; c < channels; c++)
            most = fmax(most, abs(decoded[i * channels + c] - in[i * 4 + c]));
    return most;
}

/* The comment's segment (ITU-T T.81, B.2.4.5) follows JFIF's. */
static void check_comment(const struct pen_bytes *jpeg, const char *want)
{
    const uint8_t *p = jpeg->data + 2;
    CHECK(jpeg->size > 64 && p[0] == 0xff && p[1] == 0xe0);
    p += 2 + (p[2] << 8 | p[3]);
    CHECK(p[0] == 0xff && p[1] == 0xfe && (p[2] << 8 | p[3]) == (int)strlen(want) + 2);
    CHECK(!memcmp(p + 4, want, strlen(want)));
}

static void jpeg(uint32_t width, uint32_t height, uint32_t channels)
{
    struct pen_frame frame;
    gradient(&frame, width, height, channels);
    struct pen_bytes bytes = encode(&frame, PEN_JPEG, 0, 95);
    tjhandle tj = tjInitDecompress();
    int w, h, sampling, space;
    CHECK(tjDecompressHeader3(tj, bytes.data, bytes.size, &w, &h, &sampling, &space) == 0);
    CHECK(w == (int)width && h == (int)height);
    check_comment(&bytes, "technique=pcss");
    CHECK((space == TJCS_GRAY) == (channels == 1));
    uint32_t decoded_channels = channels == 1 ? 1 : 3;
    uint8_t *decoded = malloc((size_t)width * height * 3);
    CHECK(tjDecompress2(tj, bytes.data, bytes.size, decoded, w, 0, h,
              channels == 1 ? TJPF_GRAY : TJPF_RGB, TJFLAG_ACCURATEDCT) == 0);
    CHECK(worst(&frame, decoded, decoded_channels) <= 8);
    struct pen_bytes rough = encode(&frame, PEN_JPEG, 0, 5);
    CHECK(rough.size < bytes.size || width * height < 100);
    pen_bytes_finish(&rough);
    tjDestroy(tj);
    free(decoded);
    pen_bytes_finish(&bytes);
    pattern_finish(&frame);
}

static void webp(uint32_t width, uint32_t height, uint32_t channels, uint32_t quality)
{
    struct pen_frame frame;
    gradient(&frame, width, height, channels);
    if (channels == 1)
        for (size_t i = 0; i < (size_t)width * height; i++) {
            uint8_t *p = (uint8_t *)frame.planes[0].data + i * 4;
            p[1] = p[2] = p[0];
        }
    struct pen_bytes bytes = encode(&frame, PEN_WEBP, 0, quality);
    int w = 0, h = 0;
    uint32_t decoded_channels = channels == 4 ? 4 : 3;
    uint8_t *decoded = channels == 4 ? WebPDecodeRGBA(bytes.data, bytes.size, &w, &h)
                                     : WebPDecodeRGB(bytes.data, bytes.size, &w, &h);
    CHECK(decoded && w == (int)width && h == (int)height);
    if (decoded)
        CHECK(worst(&frame, decoded, decoded_channels) <= (quality == 100 ? 0 : 10));
    WebPFree(decoded);
    pen_bytes_finish(&bytes);
    pattern_finish(&frame);
}

static void refusals(void)
{
    static const struct pen_output wrong[] = {{.format = PEN_JPEG, .bit_depth = 16},
        {.format = PEN_EXR, .bit_depth = 8}, {.format = PEN_PNG, .bit_depth = 32},
        {.format = PEN_FORMATS}};
    struct pen_frame frame;
    gradient(&frame, 4, 4, 3);
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        struct pen_bytes bytes = {(uint8_t *)1, 1};
        struct pen_error error = {0};
        CHECK(!pen_encode(&frame, &wrong[i], NULL, 0, &bytes, &error));
        CHECK(error.code == PEN_INTERNAL && !bytes.data && !bytes.size);
    }
    frame.planes[0].channels = 2;
    struct pen_bytes bytes;
    struct pen_error error = {0};
    CHECK(!pen_encode(&frame, &(struct pen_output){.format = PEN_PNG}, NULL, 0, &bytes, &error));
    pattern_finish(&frame);
}

#define THREADS 4
static struct pen_bytes results[THREADS][PEN_FORMATS];

static void *encode_all(void *arg)
{
    struct pen_bytes *mine = arg;
    for (uint32_t format = 0; format < PEN_FORMATS; format++) {
        struct pen_frame frame;
        gradient(&frame, 97, 61, 3);
        if (format == PEN_EXR) {
            free(frame.planes[0].data);
            pattern_plane(&frame.planes[0], "beauty", PEN_PIXEL_RGBA16F, 3, 97 * 61, true);
        }
        mine[format] = encode(&frame, format, 0, 90);
        pattern_finish(&frame);
    }
    return NULL;
}

static void threads(void)
{
    pthread_t thread[THREADS];
    for (int i = 0; i < THREADS; i++)
        pthread_create(&thread[i], NULL, encode_all, results[i]);
    for (int i = 0; i < THREADS; i++)
        pthread_join(thread[i], NULL);
    for (int i = 0; i < THREADS; i++)
        for (uint32_t format = 0; format < PEN_FORMATS; format++) {
            CHECK(
                results[i][format].size && results[i][format].size == results[0][format].size &&
                !memcmp(results[i][format].data, results[0][format].data, results[0][format].size));
            if (i)
                pen_bytes_finish(&results[i][format]);
        }
    for (uint32_t format = 0; format < PEN_FORMATS; format++)
        pen_bytes_finish(&results[0][format]);
}

static int count_threads(void)
{
    int count = 0;
    DIR *tasks = opendir("/proc/self/task");
    for (struct dirent *entry; tasks && (entry = readdir(tasks));)
        count += entry->d_name[0] != '.';
    if (tasks)
        closedir(tasks);
    return count;
}

static void *do_nothing(void *arg)
{
    return arg;
}

int main(void)
{
    pthread_t first; /* with the first one a sanitizer starts its own */
    pthread_create(&first, NULL, do_nothing, NULL);
    pthread_join(first, NULL);
    int threads_before = count_threads();
    threads(); /* first, so that first-use initialisation is raced for */
    CHECK(count_threads() == threads_before); /* no pool is kept behind our back */
    jpeg(160, 120, 3);
    jpeg(160, 120, 4);
    jpeg(33, 57, 1);
    jpeg(1, 1, 3);
    jpeg(1, 8192, 3);
    jpeg(8191, 3, 3);
    for (uint32_t quality = 90; quality <= 100; quality += 10) {
        webp(160, 120, 3, quality);
        webp(160, 120, 4, quality);
        webp(31, 17, 1, quality);
        webp(1, 1, 3, quality);
        webp(8191, 3, 3, quality);
    }
    refusals();
    CHECK_DONE();
}
