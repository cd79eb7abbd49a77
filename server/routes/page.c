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

static int key_index(const char *const *keys, const char *key)
{
    for (int k = 0; keys && keys[k]; k++)
        if (!strcmp(keys[k], key))
            return k;
    return -1;
}

static bool refuse_key(const char *const *keys, struct pen_error *error)
{
    char list[128] = "";
    for (int k = 0; keys && keys[k]; k++)
        snprintf(list + strlen(list), sizeof list - strlen(list), ", %s", keys[k]);
    return pen_fail(error, PEN_INVALID, "", "This list takes only the keys limit, after%s.", list);
}

bool page_read(
    struct call *call, const char *const *keys, struct page *page, struct pen_error *error)
{
    struct pen_query_pair pairs[HTTP_MAX_PAIRS];
    uint32_t count;
    *page = (struct page){.limit = PAGE_DEFAULT};
    if (!http_split_query(call->exchange->query, pairs, &count, error))
        return false;
    for (uint32_t i = 0; i < count; i++) {
        const char *value = pairs[i].value ? pairs[i].value : "";
        int own = key_index(keys, pairs[i].key);
        if (!strcmp(pairs[i].key, "limit")) {
            if (!read_limit(value, page, error))
                return false;
        } else if (!strcmp(pairs[i].key, "after")) {
            if (!(page->has_after = pen_id_from_hex(value, page->after)))
                return pen_fail(error, PEN_INVALID, "/after", "after must be an id.");
        } else if (own >= 0) {
            snprintf(page->values[own], sizeof page->values[own], "%s", value);
        } else {
            return refuse_key(keys, error);
        }
    }
    return true;
}

bool page_is_chosen(const struct page *page)
{
    return page->values[0][0] || page->values[1][0];
}

void page_write_next(struct pen_json *json, const char *path, const char *const *keys,
    const struct page *page, const uint8_t last[PEN_ID_BYTES])
{
    char next[PEN_ID_HEX + 64 + PAGE_KEYS * (3 * PEN_LABEL_NAME_BYTES + 16)], hex[PEN_ID_HEX + 1];
    pen_id_to_hex(last, hex);
    char *out = next + sprintf(next, "%s?limit=%u&after=%s", path, page->limit, hex);
    for (int k = 0; keys && keys[k]; k++) {
        if (!page->values[k][0])
            continue;
        out += sprintf(out, "&%s=", keys[k]);
        for (const char *c = page->values[k]; *c; c++)
            out += sprintf(out, "%%%02x", (unsigned char)*c);
    }
    pen_json_link(json, "next", next);
}
