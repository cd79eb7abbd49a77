/* Text from an upload, made fit for a message. */
#pragma once
#ifdef __cplusplus
extern "C" {
#endif

struct imp_text {
    char s[104];
};

/* At most 100 bytes of `text`, whole characters; whatever cannot be read on a page (control
 * characters, what is not UTF-8) becomes '?'. */
struct imp_text imp_text(const char *text);

#ifdef __cplusplus
}
#endif
