#include "renderer/import/base/text.h"
#include <string.h>
#include <utf8proc.h>

#define MOST 100

static bool is_readable(utf8proc_int32_t character)
{
    utf8proc_category_t kind = utf8proc_category(character);
    return kind != UTF8PROC_CATEGORY_CC && kind != UTF8PROC_CATEGORY_CF &&
           kind != UTF8PROC_CATEGORY_CN && kind != UTF8PROC_CATEGORY_CO &&
           kind != UTF8PROC_CATEGORY_CS && kind != UTF8PROC_CATEGORY_ZL &&
           kind != UTF8PROC_CATEGORY_ZP;
}

struct imp_text imp_text(const char *text)
{
    struct imp_text t;
    size_t out = 0, left = strlen(text);
    while (left) {
        utf8proc_int32_t character;
        utf8proc_ssize_t n =
            utf8proc_iterate((const utf8proc_uint8_t *)text, (utf8proc_ssize_t)left, &character);
        bool readable = n > 0 && is_readable(character);
        size_t taken = n > 0 ? (size_t)n : 1;
        if (out + (readable ? taken : 1) > MOST)
            break;
        if (readable)
            memcpy(t.s + out, text, taken);
        else
            t.s[out] = '?';
        out += readable ? taken : 1;
        text += taken;
        left -= taken;
    }
    t.s[out] = 0;
    return t;
}
