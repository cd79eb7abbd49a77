/* Runs the real penumbra-import, as the front end does. */
#pragma once
#include "renderer/import/import.h"
#include <stddef.h>

struct run {
    int status;    /* as wait() gives it */
    bool reported; /* exactly one struct pen_error came */
    struct pen_error error;
    double seconds; /* of processor time */
    long memory_mb; /* largest resident set */
    void *blob;     /* what was written to the output, to be freed; NULL when nothing */
    size_t blob_bytes;
};

/* `path`: the upload; it is an image when its name ends like one. `options`: NULL or one more
 * argument such as "--memory-mb=64". */
struct run run_importer(const char *path, const char *option);
