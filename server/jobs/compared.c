#include "server/jobs/compared.h"
#include "protocol/memory.h"
#include <stdio.h>
#include <stdlib.h>

#define LINK_BYTES (2 * PEN_ID_HEX)

/* Keeps a picture and says where; NULL when there is none or it is too large to be kept. */
static const char *keep(struct result_cache *cache, struct picture *picture, char link[LINK_BYTES])
{
    if (!picture || !result_cache_put(cache, picture))
        return NULL;
    snprintf(link, LINK_BYTES, "/v1/results/%s", picture->tag);
    return link;
}

static const char *link_image(const struct compared_extra *extra, const struct compare_row *row,
    uint32_t number, char link[LINK_BYTES])
{
    if (!extra->frames)
        return keep(extra->cache, row->image, link);
    snprintf(link, LINK_BYTES, "%s/%u", extra->frames, number);
    return row->image ? link : NULL;
}

/* With the links in place. */
static struct pen_compared describe(const struct compared_extra *extra,
    const struct compare_row *row, uint32_t number, char links[4][LINK_BYTES])
{
    struct result_cache *cache = extra->cache;
    return (struct pen_compared){.result = &row->result,
        .image = link_image(extra, row, number, links[0]),
        .difference = keep(cache, row->maps[MEASURE_MAP_DIFFERENCE], links[1]),
        .ssim_map = keep(cache, row->maps[MEASURE_MAP_SSIM], links[2]),
        .flip_map = keep(cache, row->maps[MEASURE_MAP_FLIP], links[3])};
}

char *compared_row(const struct pen_compare *asked, const struct compare_row *rows, uint32_t number,
    const struct compared_extra *extra)
{
    char links[4][LINK_BYTES];
    struct pen_compared row = describe(extra, &rows[number], number, links);
    return pen_compared_json(asked, &row, number, extra->catalogue);
}

char *compared_document(const struct pen_compare *asked, const struct compare_row *rows,
    const struct compared_extra *extra)
{
    uint32_t count = 1 + asked->count;
    struct pen_compared *out = pen_alloc_zero(count, sizeof *out);
    char(*links)[4][LINK_BYTES] = pen_alloc_zero(count, sizeof *links);
    for (uint32_t i = 0; i < count; i++)
        out[i] = describe(extra, &rows[i], i, links[i]);
    char *text = pen_compare_json(asked, out, extra->request_id, extra->total_ms, extra->catalogue);
    free(links);
    free(out);
    return text;
}
