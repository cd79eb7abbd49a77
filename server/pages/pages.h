/* The pages: the viewer and the readable API page as they lie in server/pages/, and the modules of
 * clients/js/ for pages of others. */
#pragma once
#include "protocol/limits.h"
#include <stddef.h>

enum page_type { PAGE_HTML, PAGE_MODULE, PAGE_STYLE };

/* A file in one coding; the tag is of these very bytes. */
struct page_bytes {
    const void *data;
    size_t bytes;
    char tag[PEN_ID_HEX + 1];
};
struct page_file {
    enum page_type type;
    const char *path; /* its address below "/" */
    struct page_bytes plain, gzip;
};

/* The file at an address below "/", or NULL. Thread-safe. */
const struct page_file *pages_find(const char *path);
extern const char *const page_mime[];
