/* RFC 2397, read kindly: its words in any case, blanks around them, base64 that is wrapped,
 * percent-encoded or of the URL alphabet, and payloads without base64. */
#include "protocol/hex.h"
#include "renderer/import/document/document.h"
#include <string.h>
#include <strings.h>

#define BLANKS " \t\r\n"

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

/* Percent-decodes in place; returns the number of bytes, of which any may be zero. */
static size_t percent_decode(uint8_t *text, size_t bytes)
{
    size_t out = 0;
    for (size_t i = 0; i < bytes; i++) {
        int high = text[i] == '%' && bytes - i > 2 ? pen_hex_digit((char)text[i + 1]) : -1;
        int low = high >= 0 ? pen_hex_digit((char)text[i + 2]) : -1;
        text[out++] = low >= 0 ? (uint8_t)(high << 4 | low) : text[i];
        i += low >= 0 ? 2 : 0;
    }
    return out;
}

/* In place: what is written never overtakes what is read. */
static bool base64_decode(uint8_t *text, size_t *bytes)
{
    const uint8_t *table = sextets();
    size_t out = 0;
    uint32_t bits = 0, count = 0;
    bool ended = false;
    for (size_t i = 0; i < *bytes; i++) {
        uint8_t c = text[i];
        if (c == ' ' || c == '\t' || c == '\r' || c == '\n')
            continue;
        ended = ended || c == '=';
        if (c == '=')
            continue;
        if (ended || table[c] == 0xff)
            return false;
        bits = bits << 6 | table[c];
        if (++count == 4) {
            text[out++] = (uint8_t)(bits >> 16);
            text[out++] = (uint8_t)(bits >> 8);
            text[out++] = (uint8_t)bits;
            count = 0;
        }
    }
    if (count == 1)
        return false;
    if (count >= 2)
        text[out++] = (uint8_t)(bits >> (count == 2 ? 4 : 10));
    if (count == 3)
        text[out++] = (uint8_t)(bits >> 2);
    *bytes = out;
    return true;
}

static void trim(char *text)
{
    size_t bytes = strlen(text);
    while (bytes && strchr(BLANKS, text[bytes - 1]))
        text[--bytes] = 0;
}

bool imp_is_data_uri(const char *uri)
{
    return !strncasecmp(uri + strspn(uri, BLANKS), "data:", 5);
}

bool imp_data_uri_decode(char *uri, const char **mime, struct imp_bytes *payload)
{
    if (!imp_is_data_uri(uri))
        return false;
    uri += strspn(uri, BLANKS);
    char *comma = strchr(uri, ',');
    if (!comma)
        return false;
    *comma = 0;
    uri[percent_decode((uint8_t *)uri, strlen(uri))] = 0;
    trim(uri); /* blanks may stand around the marker */
    char *marker = strrchr(uri, ';');
    bool base64 = marker && !strcasecmp(marker + 1 + strspn(marker + 1, BLANKS), "base64");
    uri[strcspn(uri, ";")] = 0;
    trim(uri);
    *mime = uri + 5 + strspn(uri + 5, BLANKS);
    uint8_t *data = (uint8_t *)comma + 1;
    size_t bytes = percent_decode(data, strlen(comma + 1));
    if (base64 && !base64_decode(data, &bytes))
        return false;
    *payload = (struct imp_bytes){data, bytes};
    return true;
}
