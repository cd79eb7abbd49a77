/* Checksums of the files of a stored entry, in a file beside them: what the disk, a crash or
 * somebody else has done to a file is noticed before it is used. CRC-64 of ECMA-182, the one of xz:
 * against accidents, not against those who may write to the store. */
#pragma once
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <sys/types.h>

#define STORE_SUMS "sums"

/* A file as it was when its checksum was last found right; all 0: never. A write, even one over
 * what is there, changes it. */
struct sums_mark {
    uint64_t inode, bytes;
    int64_t written_ns, changed_ns;
};

/* The checksum of bytes in memory. */
uint64_t sums_of(const void *data, size_t bytes);
/* Of the named files in `folder`, whatever their sums were; synced. */
bool sums_write(int folder, const char *const *names, uint32_t count);
/* True when `file` is what sums_write saw under that name. Read only if *mark (which may be NULL)
 * does not fit any more; brought up to date. A file that cannot be read is not sound. */
bool sums_are_right(int folder, const char *name, int file, struct sums_mark *mark);
