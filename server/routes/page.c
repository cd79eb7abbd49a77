#include "protocol/json_request.h"
#include "protocol/json_writer.h"
#include "server/http/query.h"
#include "server/routes/page.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define PAGE_DEFAULT 50

static bool read_limit(const char *value, struct page *page, struct pen_error *error)
{
    char *end;
    unsigned long n = strtoul(value, &end, 10);
    if (*value < '0' || *value > '9' || *end || n < 1 || n > PAGE_MOST)
        return pen_fail(
            error, PEN_INVALID, "/limit", "limit must be a whole number from 1 to %d.", PAGE_MOST);
    page->limit = (uint32_t)n;
    return true;
}

bool page_read(struct call *call, const char *key, struct page *page, struct pen_error *error)
{
    struct pen_query_pair pairs[HTTP_MAX_PAIRS];
    uint32_t count;
    *page = (struct page){.limit = PAGE_DEFAULT};
    if (!http_split_query(call->exchange->query, pairs, &count, error))
        return false;
    for (uint32_t i = 0; i < count; i++) {
        const char *value = pairs[i].value ? pairs[i].value : "";
        if (!strcmp(pairs[i].key, "limit")) {
            if (!read_limit(value, page, error))
                return false;
        } else if (!strcmp(pairs[i].key, "after")) {
            if (!(page->has_after = pen_id_from_hex(value, page->after)))
                return pen_fail(error, PEN_INVALID, "/after", "after must be an id.");
        } else if (key && !strcmp(pairs[i].key, key)) {
            snprintf(page->value, sizeof page->value, "%s", value);
        } else {
            return pen_fail(error, PEN_INVALID, "", "This list takes only the keys limit%s%s.",
                key ? ", after and " : " and after", key ? key : "");
        }
    }
    return true;
}

void page_write_next(struct pen_json *json, const char *path, const char *key,
    const struct page *page, const uint8_t last[PEN_ID_BYTES])
{
    char next[PEN_ID_HEX + 160], hex[PEN_ID_HEX + 1];
    pen_id_to_hex(last, hex);
    int bytes = snprintf(next, sizeof next, "%s?limit=%u&after=%s", path, page->limit, hex);
    if (*page->value)
        snprintf(next + bytes, sizeof next - (size_t)bytes, "&%s=%s", key, page->value);
    pen_json_string(json, "next", next);
}
