/* Child processes with chosen descriptors. */
#pragma once
#include "protocol/error.h"
#include <sys/types.h>

struct process {
    pid_t pid; /* 0: none */
    int pidfd; /* readable when it has ended */
};

struct process_fd {
    int from, to; /* `from` of this process becomes `to` of the child */
};

/* Starts `path` with `arguments` (arguments[0] is the name, NULL at the end) and, besides 0, 1 and
 * 2, only the descriptors of `fds`. The child is killed when the thread that started it ends.
 * Errors: PEN_INTERNAL. */
bool process_start(struct process *process, const char *path, char *const arguments[],
    const struct process_fd *fds, int fd_count, struct pen_error *error);
/* Sends a signal; harmless when it has ended. */
void process_signal(const struct process *process, int signal);
/* Waits at most `timeout_ms` (-1: forever); true when it has ended, with *status as waitpid gives
 * it. The process is then forgotten. */
bool process_wait(struct process *process, int timeout_ms, int *status);

/* "crashed (signal 11)", "exited with status 3". */
const char *process_describe(int status, char *text, size_t bytes);
/* The full path of a program that lies next to this one or where installing puts it. */
bool process_find_sibling(const char *name, char *path, size_t bytes);
