#include "server/base/process.h"
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#define MAX_FDS 8

/* Runs in the child: only async-signal-safe calls. */
static void become(const char *path, char *const arguments[], const struct process_fd *fds,
    int fd_count, pid_t parent)
{
    int from[MAX_FDS];
    int top = 2;
    for (int i = 0; i < fd_count; i++)
        top = fds[i].to > top ? fds[i].to : top;
    /* Out of the way of every target first, so that no dup2 overwrites a source. */
    for (int i = 0; i < fd_count; i++)
        if ((from[i] = fcntl(fds[i].from, F_DUPFD_CLOEXEC, top + 1)) < 0)
            _exit(126);
    for (int i = 0; i < fd_count; i++)
        if (dup2(from[i], fds[i].to) < 0)
            _exit(126);
    for (int to = 3; to <= top; to++) {
        bool wanted = false;
        for (int i = 0; i < fd_count; i++)
            wanted = wanted || fds[i].to == to;
        if (!wanted)
            close(to);
    }
    syscall(SYS_close_range, top + 1, ~0u, 0);
    sigset_t none;
    sigemptyset(&none);
    sigprocmask(SIG_SETMASK, &none, NULL);
    signal(SIGPIPE, SIG_DFL);
    setpgid(0, 0); /* a terminal's Ctrl-C is for the daemon, which then drains */
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (getppid() != parent)
        _exit(126);
    execv(path, arguments);
    _exit(127);
}

bool process_start(struct process *process, const char *path, char *const arguments[],
    const struct process_fd *fds, int fd_count, struct pen_error *error)
{
    memset(process, 0, sizeof *process);
    process->pidfd = -1;
    if (fd_count > MAX_FDS || access(path, X_OK))
        return pen_fail(error, PEN_INTERNAL, "", "A program of this service is not installed.");
    pid_t parent = getpid();
    pid_t pid = fork();
    if (pid == 0)
        become(path, arguments, fds, fd_count, parent);
    if (pid < 0)
        return pen_fail(error, PEN_INTERNAL, "", "A process could not be started.");
    process->pid = pid;
    process->pidfd = (int)syscall(SYS_pidfd_open, pid, 0);
    if (process->pidfd < 0) {
        int status;
        kill(pid, SIGKILL);
        waitpid(pid, &status, 0);
        process->pid = 0;
        return pen_fail(error, PEN_INTERNAL, "", "A process could not be watched.");
    }
    return true;
}

void process_signal(const struct process *process, int signal)
{
    if (process->pid > 0)
        syscall(SYS_pidfd_send_signal, process->pidfd, signal, NULL, 0);
}

bool process_wait(struct process *process, int timeout_ms, int *status)
{
    *status = 0;
    if (process->pid <= 0)
        return true;
    struct pollfd watch = {process->pidfd, POLLIN, 0};
    int n;
    do
        n = poll(&watch, 1, timeout_ms);
    while (n < 0 && errno == EINTR);
    if (n <= 0)
        return false;
    while (waitpid(process->pid, status, 0) < 0 && errno == EINTR)
        ;
    close(process->pidfd);
    process->pid = 0;
    process->pidfd = -1;
    return true;
}

const char *process_describe(int status, char *text, size_t bytes)
{
    if (WIFSIGNALED(status))
        snprintf(text, bytes, "ended by signal %d", WTERMSIG(status));
    else
        snprintf(text, bytes, "exited with status %d", WEXITSTATUS(status));
    return text;
}

bool process_find_sibling(const char *name, char *path, size_t bytes)
{
    ssize_t length = readlink("/proc/self/exe", path, bytes - 1);
    if (length <= 0)
        return false;
    path[length] = 0;
    char *slash = strrchr(path, '/');
    size_t room = bytes - (size_t)(slash + 1 - path);
    static const char *const folders[] = {"", PENUMBRA_LIBEXEC "/"};
    for (size_t i = 0; i < sizeof folders / sizeof *folders; i++)
        if (snprintf(slash + 1, room, "%s%s", folders[i], name) < (int)room && !access(path, X_OK))
            return true;
    return false;
}
