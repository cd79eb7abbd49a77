/* Whatever the bytes: no crash, no leak, and what is accepted is a blob that opens. A good corpus
 * is what tests/api/hostile_files.py writes; run with -rss_limit_mb=4096 -max_len=65536. */
#include "renderer/blob/pscene.h"
#include "renderer/import/import.h"
#include <stdlib.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t bytes);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t bytes)
{
    const uint8_t source[PEN_ID_BYTES] = {0};
    for (int mode = PEN_IMPORT_SCENE; mode <= PEN_IMPORT_IMAGE; mode++) {
        struct pen_error error = {0};
        void *blob = NULL;
        size_t blob_bytes = 0;
        bool done =
            pen_import(data, bytes, (enum pen_import_mode)mode, source, &blob, &blob_bytes, &error);
        if (done) {
            struct psc_scene scene;
            if (error.code != PEN_OK || !psc_open_memory(blob, blob_bytes, &scene, &error))
                abort();
            free(blob);
        } else if (pen_code_blame(error.code) != PEN_BLAME_CALLER) {
            abort(); /* nothing that a client sends is our fault */
        }
    }
    return 0;
}
