/* Which part of a list is asked for. */
#pragma once
#include "server/routes/call.h"

#define PAGE_MOST 200

struct page {
    uint32_t limit;
    bool has_after;
    uint8_t after[PEN_ID_BYTES];
    char value[32]; /* of the list's own key; "": not given */
};
/* limit, after, and `key` (NULL: nothing else) from the query. Errors: PEN_INVALID. */
bool page_read(struct call *call, const char *key, struct page *page, struct pen_error *error);
/* "next": the address of the page behind, after the last one that is shown. */
void page_write_next(struct pen_json *json, const char *path, const char *key,
    const struct page *page, const uint8_t last[PEN_ID_BYTES]);
