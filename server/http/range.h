/* The Range header (RFC 9110, section 14). */
#pragma once
#include <stdbool.h>
#include <stdint.h>

enum range { RANGE_ALL, RANGE_PART, RANGE_OUTSIDE };
/* What is wanted of `bytes` bytes: *from and *count of RANGE_PART. RANGE_ALL when there is no header,
 * when it says something else than one range of bytes, and when If-Range (NULL: none) does not name
 * the strong tag: then it may be ignored. */
enum range range_read(const char *range, const char *if_range, const char *tag, uint64_t bytes,
    uint64_t *from, uint64_t *count);
