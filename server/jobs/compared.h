/* What a comparison gives, as a document. */
#pragma once
#include "protocol/json_compare.h"
#include "server/queue/compare.h"
#include "server/store/result_cache.h"

struct compared_extra {
    const struct pen_catalogue *catalogue;
    struct result_cache *cache; /* keeps the images that are linked to */
    const char *request_id;     /* NULL: none */
    const char *frames; /* images are kept under this address, by number; NULL: in the cache */
    double total_ms;
};
/* malloc'd JSON; one row per request, the reference first. */
char *compared_document(const struct pen_compare *asked, const struct compare_row *rows,
    const struct compared_extra *extra);
/* One of its rows, 0 the reference, which must be done; malloc'd JSON. */
char *compared_row(const struct pen_compare *asked, const struct compare_row *rows, uint32_t number,
    const struct compared_extra *extra);
