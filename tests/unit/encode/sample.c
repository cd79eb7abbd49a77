/* Writes one encoded pattern frame, for encode/check_files.py.
 * sample FORMAT BITS PIXEL CHANNELS WIDTH HEIGHT PLANES OUT; PIXEL: 8, 16 or 32; PLANES: a comma
 * list of layer names; OUT: the file. */
#include "tests/unit/check.h"
#include "tests/unit/encode/pattern.h"

int main(int argc, char **argv)
{
    if (argc != 9)
        return 2;
    int format = pen_choice_index(pen_format_names, argv[1]);
    struct pen_output output = {
        .format = (uint32_t)format, .bit_depth = (uint32_t)atoi(argv[2]), .quality = 92};
    uint32_t pixel = !strcmp(argv[3], "8")    ? PEN_PIXEL_RGBA8
                     : !strcmp(argv[3], "16") ? PEN_PIXEL_RGBA16F
                                              : PEN_PIXEL_RGBA32F;
    struct pen_frame frame = {.width = (uint32_t)atoi(argv[5]), .height = (uint32_t)atoi(argv[6])};
    for (char *name = strtok(argv[7], ","); name; name = strtok(NULL, ",")) {
        uint32_t kind = pixel;
        uint32_t channels = (uint32_t)atoi(argv[4]);
        if (frame.plane_count > 0) { /* later planes differ in width and precision */
            channels = strcmp(name, "depth") ? 3 : 1;
            kind = !strcmp(name, "depth") || !strcmp(name, "position") ? PEN_PIXEL_RGBA32F : pixel;
        }
        pattern_plane(&frame.planes[frame.plane_count++], name, kind, channels,
            (size_t)frame.width * frame.height, format == PEN_EXR);
    }
    const char *attributes[] = {"technique=pcss", "title=a scene, with = and \"quotes\"", "=none"};
    struct pen_bytes bytes;
    struct pen_error error = {0};
    if (!pen_encode(&frame, &output, attributes, 3, &bytes, &error)) {
        fprintf(stderr, "%s\n", error.message);
        return 1;
    }
    struct pen_bytes again; /* the same request, the same bytes */
    if (!pen_encode(&frame, &output, attributes, 3, &again, &error) || again.size != bytes.size ||
        memcmp(again.data, bytes.data, bytes.size) != 0)
        return 3;
    pen_bytes_finish(&again);
    FILE *file = fopen(argv[8], "wb");
    bool ok = file && fwrite(bytes.data, 1, bytes.size, file) == bytes.size;
    ok = file && fclose(file) == 0 && ok;
    pen_bytes_finish(&bytes);
    pattern_finish(&frame);
    return ok ? 0 : 1;
}
