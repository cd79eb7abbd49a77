/* The pages: the viewer and the readable API page as they lie in server/pages/, and the modules of
 * clients/js/ for pages of others. */
#pragma once
#include "protocol/limits.h"
#include <stddef.h>

enum page_type { PAGE_HTML, PAGE_MODULE, PAGE_STYLE, PAGE_JSON };

/* A file in one coding; the tag is of these very bytes. */
struct page_bytes {
    const void *data;
    size_t bytes;
    char tag[PEN_ID_HEX + 1];
};
struct page_file {
    enum page_type type;
    const char *path; /* its address below "/"; NULL for a document made at run time */
    struct page_bytes plain, gzip;
};

/* The file at an address below "/", or NULL. Thread-safe. */
const struct page_file *pages_find(const char *path);
/* Makes a document of a malloc'd text, which it takes. Ends with pages_unmake. */
void pages_make(struct page_file *file, enum page_type type, char *text);
void pages_unmake(struct page_file *file); /* all zero is fine */
extern const char *const page_mime[];
