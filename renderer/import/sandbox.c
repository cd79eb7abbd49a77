#include "renderer/import/sandbox.h"
#include <errno.h>
#include <seccomp.h>
#include <stdio.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define SANITIZED 1 /* shadow memory needs terabytes of address space */
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define SANITIZED 1
#endif
#endif
#ifndef SANITIZED
#define SANITIZED 0
#endif

/* The kernel's interface (Documentation/userspace-api/landlock.rst), spelled out because the build
 * machine's headers may be older than the kernel that runs. */
struct landlock_rules {
    uint64_t handled_access_fs, handled_access_net, scoped;
};
#define LANDLOCK_VERSION_FLAG 1u
#ifndef SYS_landlock_create_ruleset
#define SYS_landlock_create_ruleset 444
#define SYS_landlock_restrict_self 446
#endif

bool pen_sandbox_enter_landlock(void)
{
    long version = syscall(SYS_landlock_create_ruleset, NULL, 0, LANDLOCK_VERSION_FLAG);
    if (version < 1) {
        fprintf(stderr, "penumbra-import: this kernel has no Landlock; going on without it\n");
        return false;
    }
    /* Every file system right that the version knows: 13, then REFER, TRUNCATE and IOCTL_DEV. */
    unsigned rights = version >= 5 ? 16 : version >= 3 ? 15 : version == 2 ? 14 : 13;
    struct landlock_rules rules = {.handled_access_fs = (1ull << rights) - 1};
    size_t bytes = sizeof rules.handled_access_fs;
    if (version >= 4) {
        rules.handled_access_net = 3; /* bind and connect, TCP */
        bytes = 2 * sizeof(uint64_t);
    }
    if (version >= 6) {
        rules.scoped = 3; /* abstract sockets and signals */
        bytes = 3 * sizeof(uint64_t);
    }
    int fd = (int)syscall(SYS_landlock_create_ruleset, &rules, bytes, 0);
    bool done = fd >= 0 && !syscall(SYS_landlock_restrict_self, fd, 0);
    if (!done)
        fprintf(stderr, "penumbra-import: Landlock refused: %s\n", strerror(errno));
    if (fd >= 0)
        close(fd);
    return done;
}

static const int allowed[] = {SCMP_SYS(brk), SCMP_SYS(clock_gettime), SCMP_SYS(close),
    SCMP_SYS(exit), SCMP_SYS(exit_group), SCMP_SYS(fstat), SCMP_SYS(ftruncate), SCMP_SYS(futex),
    SCMP_SYS(getpid), SCMP_SYS(getrandom), SCMP_SYS(gettid), SCMP_SYS(lseek), SCMP_SYS(madvise),
    SCMP_SYS(mremap), SCMP_SYS(munmap), SCMP_SYS(pread64), SCMP_SYS(pwrite64), SCMP_SYS(read),
    SCMP_SYS(restart_syscall), SCMP_SYS(rt_sigaction), SCMP_SYS(rt_sigprocmask),
    SCMP_SYS(rt_sigreturn), SCMP_SYS(sched_yield), SCMP_SYS(sigaltstack), SCMP_SYS(write),
    SCMP_SYS(writev)};

static bool add_rules(scmp_filter_ctx filter)
{
    for (size_t i = 0; i < sizeof allowed / sizeof *allowed; i++)
        if (seccomp_rule_add(filter, SCMP_ACT_ALLOW, allowed[i], 0))
            return false;
    /* Memory, but never memory that can be executed. */
    if (seccomp_rule_add(
            filter, SCMP_ACT_ALLOW, SCMP_SYS(mmap), 1, SCMP_A2(SCMP_CMP_MASKED_EQ, PROT_EXEC, 0)) ||
        seccomp_rule_add(filter, SCMP_ACT_ALLOW, SCMP_SYS(mprotect), 1,
            SCMP_A2(SCMP_CMP_MASKED_EQ, PROT_EXEC, 0)))
        return false;
    /* abort() sends its signal to this very process. */
    return !seccomp_rule_add(
        filter, SCMP_ACT_ALLOW, SCMP_SYS(tgkill), 1, SCMP_A0(SCMP_CMP_EQ, (scmp_datum_t)getpid()));
}

static void enter_seccomp(void)
{
    scmp_filter_ctx filter = seccomp_init(SCMP_ACT_ERRNO(EPERM));
    if (!filter || !add_rules(filter) || seccomp_load(filter))
        fprintf(stderr, "penumbra-import: this kernel has no seccomp filters; going on without\n");
    seccomp_release(filter);
}

static uint64_t mapped_bytes(void)
{
    /* The first number of statm is the size of the address space in pages. */
    unsigned long pages = 0;
    FILE *statm = fopen("/proc/self/statm", "r");
    if (statm) {
        if (fscanf(statm, "%lu", &pages) != 1)
            pages = 0;
        fclose(statm);
    }
    return pages ? (uint64_t)pages * (uint64_t)sysconf(_SC_PAGESIZE) : 256ull << 20;
}

static bool limit(int resource, uint64_t soft, uint64_t hard, struct pen_error *error)
{
    struct rlimit r;
    if (!getrlimit((__rlimit_resource_t)resource, &r)) {
        r.rlim_max = hard < r.rlim_max ? hard : r.rlim_max;
        r.rlim_cur = soft < r.rlim_max ? soft : r.rlim_max;
        if (!setrlimit((__rlimit_resource_t)resource, &r))
            return true;
    }
    return pen_fail(error, PEN_INTERNAL, "", "The importer could not limit itself.");
}

bool pen_sandbox_enter(const struct pen_sandbox_limits *limits, struct pen_error *error)
{
    uint64_t memory = mapped_bytes() + limits->memory_bytes, cpu = limits->cpu_seconds;
    prctl(PR_SET_DUMPABLE, 0);
    if (prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0))
        fprintf(stderr, "penumbra-import: no_new_privs refused: %s\n", strerror(errno));
    pen_sandbox_enter_landlock();
    if (!limit(RLIMIT_CORE, 0, 0, error) || !limit(RLIMIT_CPU, cpu, cpu + 1, error) ||
        !limit(RLIMIT_FSIZE, limits->output_bytes, limits->output_bytes, error) ||
        !limit(RLIMIT_NPROC, 0, 0, error) || !limit(RLIMIT_NOFILE, 0, 0, error) ||
        (!SANITIZED && !limit(RLIMIT_AS, memory, memory, error)))
        return false;
    enter_seccomp();
    return true;
}
