#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfOutputFile.h>
#include <ImfStandardAttributes.h>
#include <ImfStringAttribute.h>
#include <ImfThreading.h>
#include <cstring>
#include <exception>
#include <mutex>
#include <new>
#include <string>
#include <vector>

extern "C" {
#include "renderer/encode/exr_shim.h"
}

namespace
{

constexpr uint32_t rows_per_call = 64; /* a multiple of what ZIP compresses together */

class Memory : public Imf::OStream
{
  public:
    Memory() : OStream("memory") {}
    ~Memory() override
    {
        pen_bytes_finish(&file.bytes);
    }
    void write(const char *data, int size) override
    {
        if (!bytes_file_write(&file, data, (size_t)size))
            throw std::bad_alloc();
    }
    uint64_t tellp() override
    {
        return file.at;
    }
    void seekp(uint64_t to) override
    {
        file.at = to;
    }

    struct bytes_file file = {};
};

Imf::Header describe(const struct exr_file *file)
{
    Imf::Header header((int)file->width, (int)file->height);
    header.compression() = Imf::ZIP_COMPRESSION;
    for (uint32_t c = 0; c < file->channels; c++)
        header.channels().insert(
            file->names[c], Imf::Channel(file->half[c] ? Imf::HALF : Imf::FLOAT));
    if (file->bt709) /* red, green, blue, white; the default is D65 too */
        Imf::addChromaticities(header,
            Imf::Chromaticities({0.64f, 0.33f}, {0.3f, 0.6f}, {0.15f, 0.06f}, {0.3127f, 0.329f}));
    for (uint32_t i = 0; i < file->attribute_count; i++) {
        const char *equals = std::strchr(file->attributes[i], '=');
        if (!equals || equals == file->attributes[i])
            continue;
        std::string key(file->attributes[i], equals);
        if (header.find(key) == header.end()) /* what the format needs is not replaced */
            header.insert(key, Imf::StringAttribute(equals + 1));
    }
    return header;
}

void write(const struct exr_file *file, encode_rows *rows, void *user, Memory &memory)
{
    static std::once_flag once;
    /* The callers are threads of their own already: a pool inside would only fight them. */
    std::call_once(once, [] { Imf::setGlobalThreadCount(0); });
    Imf::OutputFile out(memory, describe(file), 0);
    const size_t pixel_bytes = sizeof(float) * file->channels;
    const size_t row_bytes = pixel_bytes * file->width;
    std::vector<char> strip(row_bytes * rows_per_call);
    for (uint32_t y = 0; y < file->height; y += rows_per_call) {
        uint32_t count = file->height - y < rows_per_call ? file->height - y : rows_per_call;
        rows(user, y, count, strip.data());
        for (uint32_t c = 0; c < file->channels; c++)
            for (size_t at = c * sizeof(float); file->half[c] && at < row_bytes * count;
                 at += pixel_bytes) { /* takes the first half of its place */
                float value;
                std::memcpy(&value, &strip[at], sizeof value);
                const half stored(value);
                std::memcpy(&strip[at], &stored, sizeof stored);
            }
        Imf::FrameBuffer buffer; /* its origin is row 0 of the picture, not of the strip */
        char *origin =
            reinterpret_cast<char *>(reinterpret_cast<uintptr_t>(strip.data()) - row_bytes * y);
        for (uint32_t c = 0; c < file->channels; c++)
            buffer.insert(file->names[c], Imf::Slice(file->half[c] ? Imf::HALF : Imf::FLOAT,
                                              origin + c * sizeof(float), pixel_bytes, row_bytes));
        out.setFrameBuffer(buffer);
        out.writePixels((int)count);
    }
}

} // namespace

bool exr_write(const struct exr_file *file, encode_rows *rows, void *user, struct pen_bytes *bytes,
    struct pen_error *error)
{
    try {
        Memory memory;
        write(file, rows, user, memory); /* the table of rows is there when the file has ended */
        *bytes = memory.file.bytes;
        memory.file = {};
        return true;
    } catch (const std::exception &e) {
        return pen_fail(error, PEN_INTERNAL, "", "The EXR file could not be encoded: %s", e.what());
    } catch (...) {
        return pen_fail(error, PEN_INTERNAL, "", "The EXR file could not be encoded.");
    }
}
