#include "renderer/encode/tiff.h"
#include "renderer/encode/pixels.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <tiffio.h>

#define ROWS_PER_STRIP 64
#define DEFLATE_LEVEL 1 /* for speed, as all that is sent */

struct output {
    struct bytes_file file;
    char message[160]; /* what the library said first */
};

static tmsize_t no_read(thandle_t handle, void *data, tmsize_t size)
{
    (void)handle, (void)data, (void)size;
    return 0;
}

static tmsize_t append(thandle_t handle, void *data, tmsize_t size)
{
    struct output *out = handle;
    return bytes_file_write(&out->file, data, (size_t)size) ? size : 0;
}

static toff_t seek(thandle_t handle, toff_t to, int whence)
{
    struct bytes_file *file = &((struct output *)handle)->file;
    file->at = (whence == SEEK_CUR ? file->at : whence == SEEK_END ? file->bytes.size : 0) + to;
    return file->at;
}

static int stay_open(thandle_t handle)
{
    (void)handle;
    return 0;
}

static toff_t size_of(thandle_t handle)
{
    return ((struct output *)handle)->file.bytes.size;
}

static int keep_message(
    TIFF *tiff, void *user, const char *module, const char *format, va_list arguments)
{
    struct output *out = user;
    (void)tiff, (void)module;
    if (!*out->message)
        vsnprintf(out->message, sizeof out->message, format, arguments);
    return 1; /* not for stderr */
}

static int keep_quiet(
    TIFF *tiff, void *user, const char *module, const char *format, va_list arguments)
{
    (void)tiff, (void)user, (void)module, (void)format, (void)arguments;
    return 1;
}

static TIFF *open_memory(struct output *out)
{
    TIFFOpenOptions *options = TIFFOpenOptionsAlloc();
    if (!options)
        return NULL;
    TIFFOpenOptionsSetErrorHandlerExtR(options, keep_message, out);
    TIFFOpenOptionsSetWarningHandlerExtR(options, keep_quiet, out);
    TIFF *tiff = TIFFClientOpenExt(
        "image.tif", "w", out, no_read, append, seek, stay_open, size_of, NULL, NULL, options);
    TIFFOpenOptionsFree(options);
    return tiff;
}

static bool describe(
    TIFF *tiff, const struct pen_frame *frame, uint32_t bits, const char *description)
{
    static const uint16_t alpha[] = {EXTRASAMPLE_UNASSALPHA};
    uint32_t channels = frame->planes[0].channels;
    return TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, frame->width) &&
           TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, frame->height) &&
           TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, channels) &&
           TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, bits) &&
           TIFFSetField(tiff, TIFFTAG_SAMPLEFORMAT, SAMPLEFORMAT_UINT) &&
           TIFFSetField(tiff, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG) &&
           TIFFSetField(tiff, TIFFTAG_ORIENTATION, ORIENTATION_TOPLEFT) &&
           TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC,
               channels == 1 ? PHOTOMETRIC_MINISBLACK : PHOTOMETRIC_RGB) &&
           (channels != 4 || TIFFSetField(tiff, TIFFTAG_EXTRASAMPLES, 1, alpha)) &&
           TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, ROWS_PER_STRIP) &&
           TIFFSetField(tiff, TIFFTAG_COMPRESSION, COMPRESSION_ADOBE_DEFLATE) &&
           TIFFSetField(tiff, TIFFTAG_ZIPQUALITY, DEFLATE_LEVEL) &&
           TIFFSetField(tiff, TIFFTAG_PREDICTOR, PREDICTOR_HORIZONTAL) &&
           (!*description || TIFFSetField(tiff, TIFFTAG_IMAGEDESCRIPTION, description));
}

static bool write_rows(TIFF *tiff, const struct pen_frame *frame, uint32_t bits)
{
    uint32_t channels = frame->planes[0].channels;
    enum pixels_sample sample = bits == 16 ? PIXELS_U16 : PIXELS_U8;
    void *row = malloc((size_t)frame->width * channels * bits / 8);
    bool ok = row;
    for (uint32_t y = 0; ok && y < frame->height; y++) {
        pixels_row(&frame->planes[0], frame->width, y, channels, sample, channels, row);
        ok = TIFFWriteScanline(tiff, row, y, 0) == 1;
    }
    free(row);
    return ok;
}

bool tiff_encode(const struct pen_frame *frame, uint32_t bits, const char *description,
    struct pen_bytes *bytes, struct pen_error *error)
{
    struct output out = {0};
    TIFF *tiff = open_memory(&out);
    bool ok = tiff && describe(tiff, frame, bits, description) && write_rows(tiff, frame, bits) &&
              TIFFFlush(tiff);
    if (tiff)
        TIFFClose(tiff);
    if (ok) {
        *bytes = out.file.bytes;
        return true;
    }
    pen_bytes_finish(&out.file.bytes);
    return pen_fail(error, PEN_INTERNAL, "", "The TIFF file could not be encoded: %s.",
        *out.message ? out.message : "out of memory");
}
