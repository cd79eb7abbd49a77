/* Text from an upload, made fit for a message. */
#pragma once
#include <stddef.h>

struct imp_text {
    char s[104];
};

/* At most 100 bytes of `text`; whatever is not printable ASCII becomes '?', so that no message
 * holds half a UTF-8 sequence or a control character. */
static inline struct imp_text imp_text(const char *text)
{
    struct imp_text t;
    size_t i = 0;
    for (; i < 100 && text[i]; i++)
        t.s[i] = text[i] >= 0x20 && text[i] < 0x7f ? text[i] : '?';
    t.s[i] = 0;
    return t;
}
