/* The sandbox from inside: each attempt in a child of its own, which exits 0 when
 * it was stopped. */
#include "renderer/import/sandbox.h"
#include "tests/unit/check.h"
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

static int writable; /* a descriptor that was open before */

static bool open_fails(void)
{
    return open("/etc/passwd", O_RDONLY) < 0 && openat(AT_FDCWD, "/tmp", O_RDONLY) < 0 &&
           open("/tmp/penumbra-sandbox-test", O_CREAT | O_WRONLY, 0600) < 0;
}

static bool socket_fails(void)
{
    int pair[2];
    return socket(AF_INET, SOCK_STREAM, 0) < 0 && socketpair(AF_UNIX, SOCK_STREAM, 0, pair) < 0;
}

static bool fork_fails(void)
{
    pid_t pid = fork();
    if (pid == 0)
        _exit(0);
    return pid < 0;
}

static bool exec_fails(void)
{
    char *const arguments[] = {"true", NULL}, *const environment[] = {NULL};
    execve("/bin/true", arguments, environment);
    return true; /* or this process is gone, replaced by one that exits 0: see main */
}

static bool ptrace_and_kill_fail(void)
{
    return syscall(SYS_ptrace, 0, 0, 0, 0) < 0 && kill(getppid(), 0) < 0;
}

static bool executable_memory_fails(void)
{
    void *p =
        mmap(NULL, 4096, PROT_READ | PROT_WRITE | PROT_EXEC, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    void *q = mmap(NULL, 4096, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    return p == MAP_FAILED && q != MAP_FAILED && mprotect(q, 4096, PROT_READ | PROT_EXEC) < 0;
}

static bool memory_is_limited(void)
{
    void *small = malloc(16 << 20), *large = malloc(128 << 20);
    return small && !large;
}

static bool limits_stay(void)
{
    struct rlimit r = {1 << 20, 1 << 20};
    return setrlimit(RLIMIT_NOFILE, &r) < 0 && dup(1) < 0 && prctl(PR_SET_DUMPABLE, 1) < 0;
}

static bool work_goes_on(void)
{
    char *p = malloc(1 << 20);
    memset(p, 1, 1 << 20);
    char *more = realloc(p, 8 << 20);
    return more && more[100] == 1 && write(writable, "x", 1) == 1 &&
           lseek(writable, 0, SEEK_CUR) == 1;
}

static bool file_size_is_limited(void)
{
    signal(SIGXFSZ, SIG_IGN);
    return pwrite(writable, "x", 1, (1 << 20) - 1) == 1 && pwrite(writable, "x", 1, 1 << 20) < 0 &&
           errno == EFBIG;
}

static bool abort_is_heard(void)
{
    return true;
}

static void on_abort(int number)
{
    (void)number;
    _exit(0);
}

static int attempt(bool (*stopped)(void))
{
    fflush(NULL);
    pid_t pid = fork();
    if (pid == 0) {
        const struct pen_sandbox_limits limits = {
            .memory_bytes = 64 << 20, .output_bytes = 1 << 20, .cpu_seconds = 5};
        struct pen_error error = {0};
        signal(SIGABRT, on_abort);
        if (!pen_sandbox_enter(&limits, &error))
            _exit(2);
        if (stopped == abort_is_heard)
            abort();
        _exit(stopped == exec_fails ? stopped() * 42 : !stopped());
    }
    int status = 0;
    waitpid(pid, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : 1000 + WTERMSIG(status);
}

/* Landlock by itself, where the kernel has it: the error is its own, not seccomp's EPERM. */
static int landlock_stops_open(void)
{
    pid_t pid = fork();
    if (pid == 0) {
        prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0);
        if (!pen_sandbox_enter_landlock())
            _exit(0);
        _exit(
            open("/etc/passwd", O_RDONLY) >= 0 || errno != EACCES || write(writable, "x", 1) != 1);
    }
    int status = 0;
    waitpid(pid, &status, 0);
    return status;
}

int main(void)
{
    writable = memfd_create("output", 0);
    int baseline = open("/etc/passwd", O_RDONLY); /* the attempts would succeed outside */
    CHECK(writable >= 0 && baseline >= 0);
    CHECK(landlock_stops_open() == 0);
    lseek(writable, 0, SEEK_SET);
    CHECK(attempt(work_goes_on) == 0);
    CHECK(attempt(open_fails) == 0);
    CHECK(attempt(socket_fails) == 0);
    CHECK(attempt(fork_fails) == 0);
    CHECK(attempt(exec_fails) == 42);
    CHECK(attempt(ptrace_and_kill_fail) == 0);
    CHECK(attempt(limits_stay) == 0);
    CHECK(attempt(file_size_is_limited) == 0);
    CHECK(attempt(abort_is_heard) == 0);
    CHECK(attempt(executable_memory_fails) == 0);
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
    CHECK(attempt(memory_is_limited) == 0);
#else
    (void)memory_is_limited;
#endif
    CHECK_DONE();
}
