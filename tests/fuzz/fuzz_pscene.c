/* psc_open_memory over damaged scene files. A blob made of chance bytes never passes the header, so
 * the input is a list of changes to a valid one: records of { u16 at, u8 how, u8 value, u32 word }.
 * A first byte of 255 means that the rest is the file itself. */
#include "renderer/generate/generate.h"
#include "tests/unit/blob_walk.h"
#include <stdlib.h>

static uint8_t *valid;
static size_t valid_bytes;

int LLVMFuzzerInitialize(int *argc, char ***argv);
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerInitialize(int *argc, char ***argv)
{
    (void)argc;
    (void)argv;
    struct pen_generated_options options = {.kind = PEN_GENERATED_STACKED};
    struct pen_error error = {0};
    void *blob;
    if (!pen_generate_blob(&options, &blob, &valid_bytes, &error))
        abort();
    valid = blob;
    return 0;
}

static void change(uint8_t *file, size_t bytes, const uint8_t record[8])
{
    size_t at = (record[0] | (size_t)record[1] << 8) % (bytes - 7);
    switch (record[2] % 4) {
    case 0:
        file[at] ^= record[3];
        break;
    case 1: /* aligned words are what the format is made of */
        memcpy(file + at / 4 * 4, record + 4, 4);
        break;
    case 2: {
        int32_t word;
        memcpy(&word, file + at / 4 * 4, 4);
        word = (int32_t)((uint32_t)word + (uint32_t)(int8_t)record[3]);
        memcpy(file + at / 4 * 4, &word, 4);
        break;
    }
    default: { /* another word of the file */
        size_t from = (record[4] | (size_t)record[5] << 8) % (bytes - 7);
        memmove(file + at / 4 * 4, file + from / 4 * 4, 4);
        break;
    }
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    bool raw = size && data[0] == 255;
    size_t bytes = raw ? size - 1 : valid_bytes;
    uint8_t *file = malloc(bytes ? bytes : 1);
    if (raw) {
        memcpy(file, data + 1, bytes);
    } else {
        memcpy(file, valid, bytes);
        for (size_t i = 0; i + 8 <= size; i += 8)
            change(file, bytes, data + i);
    }
    struct psc_scene scene;
    struct pen_error error = {0};
    double sum = 0;
    if (psc_open_memory(file, bytes, &scene, &error)) {
        if (!walk_blob(&scene, &sum))
            abort();
    } else if (error.code != PEN_INVALID || scene.header) {
        abort();
    }
    free(file);
    return 0;
}
