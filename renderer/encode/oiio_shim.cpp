#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

extern "C" {
#include "renderer/encode/oiio_shim.h"
}

namespace
{

constexpr uint32_t rows_per_call = 64; /* a multiple of what EXR's zip compresses together */

/* The callers are threads of their own already: a pool inside each would only fight them. */
void configure_once()
{
    static std::once_flag once;
    std::call_once(once, [] {
        OIIO::attribute("threads", 1);
        OIIO::attribute("exr_threads", -1);
        OIIO::attribute("debug", 0); /* the library talks to stderr otherwise */
    });
}

OIIO::TypeDesc type_of(enum pixels_sample sample)
{
    switch (sample) {
    case PIXELS_U8:
        return OIIO::TypeDesc::UINT8;
    case PIXELS_U16:
        return OIIO::TypeDesc::UINT16;
    case PIXELS_HALF:
        return OIIO::TypeDesc::HALF;
    default:
        return OIIO::TypeDesc::FLOAT;
    }
}

size_t sample_bytes(enum pixels_sample sample)
{
    return sample == PIXELS_U8 ? 1 : sample == PIXELS_U16 ? 2 : 4;
}

void describe(const struct oiio_file *file, OIIO::ImageSpec &spec)
{
    std::string description;
    for (uint32_t i = 0; i < file->attribute_count; i++) {
        const char *equals = std::strchr(file->attributes[i], '=');
        if (!equals || equals == file->attributes[i])
            continue;
        if (file->attributes_as_description) {
            description += description.empty() ? "" : "\n";
            description += file->attributes[i];
        } else {
            spec.attribute(std::string(file->attributes[i], equals), std::string(equals + 1));
        }
    }
    if (!description.empty())
        spec.attribute("ImageDescription", description);
    /* After the caller's, so that none of these can be overridden by a key. */
    spec.attribute(
        "oiio:UnassociatedAlpha", 1); /* alpha is data here: never multiplied or divided */
    if (file->bt709) {                /* red, green, blue, white */
        static const float xy[8] = {0.64f, 0.33f, 0.3f, 0.6f, 0.15f, 0.06f, 0.3127f, 0.329f};
        spec.attribute("chromaticities", OIIO::TypeDesc(OIIO::TypeDesc::FLOAT, 8), xy);
    }
    /* The writers add the current time where there is none; a value that is no text
     * keeps it out. */
    void *none = nullptr;
    spec.attribute("DateTime", OIIO::TypeDesc::PTR, &none);
    if (file->compression)
        spec.attribute("compression", file->compression);
}

bool write(const struct oiio_file *file, oiio_rows *rows, void *user, struct pen_bytes *bytes,
    struct pen_error *error)
{
    configure_once();
    std::unique_ptr<OIIO::ImageOutput> out = OIIO::ImageOutput::create(file->extension);
    if (!out)
        return pen_fail(
            error, PEN_INTERNAL, "", "This build cannot write %s files.", file->extension);
    OIIO::TypeDesc type = type_of(file->sample);
    OIIO::ImageSpec spec((int)file->width, (int)file->height, (int)file->channels, type);
    if (file->names[0][0]) {
        spec.channelnames.assign(file->names, file->names + file->channels);
        bool mixed = false;
        for (uint32_t c = 0; c < file->channels; c++)
            mixed = mixed || file->stored[c] != file->stored[0];
        spec.set_format(type_of(file->stored[0]));
        if (mixed)
            for (uint32_t c = 0; c < file->channels; c++)
                spec.channelformats.push_back(type_of(file->stored[c]));
        spec.alpha_channel = -1;
    }
    describe(file, spec);
    OIIO::Filesystem::IOVecOutput memory;
    if (!out->set_ioproxy(&memory) || !out->open("image." + std::string(file->extension), spec))
        return pen_fail(error, PEN_INTERNAL, "", "The %s file could not be started: %s",
            file->extension, out->geterror().c_str());
    std::vector<unsigned char> strip(
        sample_bytes(file->sample) * file->width * file->channels * rows_per_call);
    for (uint32_t y = 0; y < file->height; y += rows_per_call) {
        uint32_t count = file->height - y < rows_per_call ? file->height - y : rows_per_call;
        rows(user, y, count, strip.data());
        if (!out->write_scanlines((int)y, (int)(y + count), 0, type, strip.data()))
            return pen_fail(error, PEN_INTERNAL, "", "The %s file could not be encoded: %s",
                file->extension, out->geterror().c_str());
    }
    if (!out->close())
        return pen_fail(error, PEN_INTERNAL, "", "The %s file could not be finished: %s",
            file->extension, out->geterror().c_str());
    const std::vector<unsigned char> &buffer = memory.buffer();
    bytes->data = static_cast<uint8_t *>(std::malloc(buffer.size()));
    if (!bytes->data)
        return pen_fail(error, PEN_INTERNAL, "", "The image could not be encoded: out of memory.");
    std::memcpy(bytes->data, buffer.data(), buffer.size());
    bytes->size = buffer.size();
    return true;
}

} // namespace

bool oiio_write(const struct oiio_file *file, oiio_rows *rows, void *user, struct pen_bytes *bytes,
    struct pen_error *error)
{
    try {
        return write(file, rows, user, bytes, error);
    } catch (const std::exception &e) {
        return pen_fail(error, PEN_INTERNAL, "", "The %s file could not be encoded: %s",
            file->extension, e.what());
    } catch (...) {
        return pen_fail(
            error, PEN_INTERNAL, "", "The %s file could not be encoded.", file->extension);
    }
}
