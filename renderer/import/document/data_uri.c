#include "renderer/import/document/document.h"
#include <string.h>
#include <strings.h>

static const uint8_t *sextets(void)
{
    static uint8_t table[256];
    if (!table['/']) {
        memset(table, 0xff, sizeof table);
        for (int i = 0; i < 26; i++) {
            table['A' + i] = (uint8_t)i;
            table['a' + i] = (uint8_t)(26 + i);
        }
        for (int i = 0; i < 10; i++)
            table['0' + i] = (uint8_t)(52 + i);
        table['+'] = table['-'] = 62;
        table['_'] = 63;
        table['/'] = 63;
    }
    return table;
}

bool imp_data_uri_decode(char *uri, const char **mime, struct imp_bytes *payload)
{
    if (strncasecmp(uri, "data:", 5))
        return false;
    char *comma = strchr(uri, ',');
    if (!comma || comma - uri < 5 + 7 || strncasecmp(comma - 7, ";base64", 7))
        return false;
    *strchr(uri, ';') = 0;
    *mime = uri + 5;
    const uint8_t *table = sextets();
    const uint8_t *in = (const uint8_t *)comma + 1;
    size_t length = strlen(comma + 1);
    while (length && in[length - 1] == '=')
        length--;
    uint8_t *out = (uint8_t *)comma + 1; /* never overtakes `in` */
    uint32_t bits = 0, count = 0;
    for (size_t i = 0; i < length; i++) {
        if (table[in[i]] == 0xff)
            return false;
        bits = bits << 6 | table[in[i]];
        if (++count == 4) {
            *out++ = (uint8_t)(bits >> 16);
            *out++ = (uint8_t)(bits >> 8);
            *out++ = (uint8_t)bits;
            count = 0;
        }
    }
    if (count == 1)
        return false;
    if (count >= 2)
        *out++ = (uint8_t)(bits >> (count == 2 ? 4 : 10));
    if (count == 3)
        *out++ = (uint8_t)(bits >> 2);
    *payload =
        (struct imp_bytes){(const uint8_t *)comma + 1, (size_t)(out - (uint8_t *)(comma + 1))};
    return true;
}
