/* Which part of a list is asked for. */
#pragma once
#include "server/routes/call.h"

#define PAGE_MOST 200
#define PAGE_KEYS 2

struct page {
    uint32_t limit;
    bool has_after;
    uint8_t after[PEN_ID_BYTES];
    char values[PAGE_KEYS][PEN_LABEL_NAME_BYTES]; /* of the list's own keys; "": not given */
};
/* limit, after, and `keys` (ended by NULL; NULL: nothing else) from the query. Errors: PEN_INVALID. */
bool page_read(
    struct call *call, const char *const *keys, struct page *page, struct pen_error *error);
/* Whether any of the list's own keys was given. */
bool page_is_chosen(const struct page *page);
/* "next": the address of the page behind, after the last one that is shown. */
void page_write_next(struct pen_json *json, const char *path, const char *const *keys,
    const struct page *page, const uint8_t last[PEN_ID_BYTES]);
