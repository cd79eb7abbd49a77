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

char *compared_document(const struct pen_compare *asked, const struct compare_row *rows,
    const struct compared_extra *extra)
{
    uint32_t count = 1 + asked->count;
    struct pen_compared *out = pen_alloc_zero(count, sizeof *out);
    char(*links)[4][LINK_BYTES] = pen_alloc_zero(count, sizeof *links);
    for (uint32_t i = 0; i < count; i++) {
        out[i].result = &rows[i].result;
        out[i].image = link_image(extra, &rows[i], i, links[i][0]);
        out[i].difference = keep(extra->cache, rows[i].maps[MEASURE_MAP_DIFFERENCE], links[i][1]);
        out[i].ssim_map = keep(extra->cache, rows[i].maps[MEASURE_MAP_SSIM], links[i][2]);
        out[i].flip_map = keep(extra->cache, rows[i].maps[MEASURE_MAP_FLIP], links[i][3]);
    }
    char *text = pen_compare_json(asked, out, extra->request_id, extra->total_ms, extra->catalogue);
    free(links);
    free(out);
    return text;
}
