#include "renderer/import/base/name.h"
#include <string.h>

void imp_name(char to[PEN_NAME_BYTES], const char *preferred, const char *otherwise)
{
    const char *from = preferred[0] ? preferred : otherwise;
    size_t n = strlen(from);
    if (n > PEN_NAME_BYTES - 1) {
        n = PEN_NAME_BYTES - 1;
        while (n && ((unsigned char)from[n] & 0xc0) == 0x80)
            n--; /* not within a UTF-8 sequence */
    }
    memset(to, 0, PEN_NAME_BYTES);
    for (size_t i = 0; i < n; i++)
        to[i] = (unsigned char)from[i] < 0x20 || from[i] == 0x7f ? ' ' : from[i];
}
