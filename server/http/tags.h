/* Entity tags (RFC 9110, section 8.8.3). */
#pragma once
#include <stdbool.h>

/* Whether a list of them, the value of If-None-Match, names `tag` (without its quotes), weakly or
 * not. What is no list, as some proxies send, names none: then the answer is sent in full. */
bool tags_name(const char *list, const char *tag);
/* "*", which is any. */
bool tags_are_any(const char *list);
