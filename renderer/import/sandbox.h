/* The cage of the importer: what still works inside is reading and writing descriptors that are
 * already open, memory up to a limit, and leaving. */
#pragma once
#include "protocol/error.h"

struct pen_sandbox_limits {
    /* Address space beyond what is mapped at entry; ignored under ASan and TSan. */
    uint64_t memory_bytes;
    uint64_t output_bytes; /* largest size of a file written to */
    uint32_t cpu_seconds;  /* SIGXCPU then, SIGKILL a second later */
};

/* For a single-threaded process, for good. In this order: no core, no ptrace, no new privileges;
 * Landlock without any rule (Linux 5.13: no path can be opened or changed; 6.7: no TCP; 6.12: no
 * signal or abstract socket outside); resource limits; a seccomp allow-list under which every other
 * system call fails with EPERM. What the kernel lacks is told on stderr and left out. Errors:
 * PEN_INTERNAL, when a resource limit cannot be set. */
bool pen_sandbox_enter(const struct pen_sandbox_limits *limits, struct pen_error *error);

/* Only the Landlock part, for tests; false when the kernel lacks it. */
bool pen_sandbox_enter_landlock(void);
