/* Faults on demand, preloaded into the programs (LD_PRELOAD): allocations, writes to files, accepted
 * connections, OpenGL and the time of day fail when a test says so.
 *
 * PENUMBRA_FAULTS names a file of `struct control`, which the test changes while they run. A count n > 0:
 * the n-th call from now on fails; n < 0: all do; 0: none does. `own`: of allocations only those count that
 * the program's own code asks for, none of a library's. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <link.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/time.h>
#include <time.h>
#include <unistd.h>

/* test_injected.py has the same order. */
struct control {
    struct process_faults {
        int32_t allocations, writes, write_errno, accepts, gl_errors, gl_code, gl_reset, clock_s,
            hits, own, unused[6];
    } processes[3];
};
static const char *const names[3] = {"penumbrad", "penumbra-worker", "penumbra-import"};

#define IMPORT_OUTPUT_FD 4 /* renderer/import/import_process.h */
static struct process_faults *faults, *faults_of_importer;

static uintptr_t code[2]; /* of the program */

static int find_code(struct dl_phdr_info *object, size_t bytes, void *context)
{
    (void)bytes, (void)context;
    for (int i = 0; i < object->dlpi_phnum; i++) {
        const ElfW(Phdr) *part = &object->dlpi_phdr[i];
        if (part->p_type != PT_LOAD || !(part->p_flags & PF_X))
            continue;
        code[0] = object->dlpi_addr + part->p_vaddr;
        code[1] = code[0] + part->p_memsz;
    }
    return 1; /* the first is the program */
}

__attribute__((constructor)) static void attach(void)
{
    dl_iterate_phdr(find_code, NULL);
    const char *path = getenv("PENUMBRA_FAULTS");
    int fd = path ? open(path, O_RDWR | O_CLOEXEC) : -1;
    struct control *control =
        fd < 0 ? MAP_FAILED
               : mmap(NULL, sizeof *control, PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
    if (fd >= 0)
        close(fd);
    faults_of_importer = control == MAP_FAILED ? NULL : &control->processes[2];
    for (int i = 0; control != MAP_FAILED && i < 3; i++)
        if (!strcmp(program_invocation_short_name, names[i]))
            faults = &control->processes[i];
}

static int strikes(int32_t *count)
{
    int32_t n = __atomic_load_n(count, __ATOMIC_RELAXED);
    while (n > 0 &&
           !__atomic_compare_exchange_n(count, &n, n - 1, 0, __ATOMIC_RELAXED, __ATOMIC_RELAXED))
        ;
    int hit = n < 0 || n == 1;
    if (hit)
        __atomic_add_fetch(&faults->hits, 1, __ATOMIC_RELAXED);
    return hit;
}
#define STRIKES(what) (faults && strikes(&faults->what))

static void *find(const char *name);

/* ---- memory ---- */

void *__libc_malloc(size_t bytes);
void *__libc_calloc(size_t count, size_t bytes);
void *__libc_realloc(void *old, size_t bytes);

static int fails_to_allocate(const void *caller)
{
    uintptr_t at = (uintptr_t)caller;
    if (faults && faults->own && (at < code[0] || at >= code[1]))
        return 0;
    if (!STRIKES(allocations))
        return 0;
    errno = ENOMEM;
    return 1;
}

void *malloc(size_t bytes)
{
    return fails_to_allocate(__builtin_return_address(0)) ? NULL : __libc_malloc(bytes);
}

void *calloc(size_t count, size_t bytes)
{
    return fails_to_allocate(__builtin_return_address(0)) ? NULL : __libc_calloc(count, bytes);
}

void *realloc(void *old, size_t bytes)
{
    return fails_to_allocate(__builtin_return_address(0)) ? NULL : __libc_realloc(old, bytes);
}

/* ---- files ---- */

static int is_file(int fd)
{
    struct stat status;
    if (fstat(fd, &status)) /* the importer's sandbox forbids it */
        return faults == faults_of_importer && fd == IMPORT_OUTPUT_FD;
    return S_ISREG(status.st_mode) || S_ISDIR(status.st_mode);
}

static int fails_to_write(int fd)
{
    if (!faults || !__atomic_load_n(&faults->writes, __ATOMIC_RELAXED) || !is_file(fd) ||
        !strikes(&faults->writes))
        return 0;
    errno = faults->write_errno;
    return 1;
}

#define REAL(name, type) ((type)find(#name))

ssize_t write(int fd, const void *data, size_t bytes)
{
    return fails_to_write(fd) ? -1
                              : REAL(write, ssize_t(*)(int, const void *, size_t))(fd, data, bytes);
}

ssize_t pwrite(int fd, const void *data, size_t bytes, off_t at)
{
    return fails_to_write(fd)
               ? -1
               : REAL(pwrite, ssize_t(*)(int, const void *, size_t, off_t))(fd, data, bytes, at);
}

int fsync(int fd)
{
    return fails_to_write(fd) ? -1 : REAL(fsync, int (*)(int))(fd);
}

int fdatasync(int fd)
{
    return fails_to_write(fd) ? -1 : REAL(fdatasync, int (*)(int))(fd);
}

int renameat(int from_folder, const char *from, int to_folder, const char *to)
{
    return fails_to_write(to_folder)
               ? -1
               : REAL(renameat, int (*)(int, const char *, int, const char *))(
                     from_folder, from, to_folder, to);
}

int mkdirat(int folder, const char *name, mode_t mode)
{
    return fails_to_write(folder)
               ? -1
               : REAL(mkdirat, int (*)(int, const char *, mode_t))(folder, name, mode);
}

int openat(int folder, const char *name, int flags, ...)
{
    va_list more;
    va_start(more, flags);
    mode_t mode = flags & (O_CREAT | O_TMPFILE) ? va_arg(more, mode_t) : 0;
    va_end(more);
    if (flags & O_CREAT && fails_to_write(folder))
        return -1;
    return REAL(openat, int (*)(int, const char *, int, ...))(folder, name, flags, mode);
}

/* ---- connections ---- */

static int fails_to_accept(void)
{
    if (!STRIKES(accepts))
        return 0;
    errno = EMFILE;
    return 1;
}

int accept4(int fd, struct sockaddr *address, socklen_t *bytes, int flags)
{
    return fails_to_accept() ? -1
                             : REAL(accept4, int (*)(int, struct sockaddr *, socklen_t *, int))(
                                   fd, address, bytes, flags);
}

int accept(int fd, struct sockaddr *address, socklen_t *bytes)
{
    return fails_to_accept()
               ? -1
               : REAL(accept, int (*)(int, struct sockaddr *, socklen_t *))(fd, address, bytes);
}

/* ---- the time of day ---- */

int clock_gettime(clockid_t clock, struct timespec *now)
{
    int result = REAL(clock_gettime, int (*)(clockid_t, struct timespec *))(clock, now);
    if (faults && clock == CLOCK_REALTIME)
        now->tv_sec += faults->clock_s;
    return result;
}

int gettimeofday(struct timeval *restrict now, void *restrict zone)
{
    (void)zone;
    struct timespec exact;
    clock_gettime(CLOCK_REALTIME, &exact);
    *now = (struct timeval){exact.tv_sec, exact.tv_nsec / 1000};
    return 0;
}

time_t time(time_t *to)
{
    struct timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    if (to)
        *to = now.tv_sec;
    return now.tv_sec;
}

/* ---- OpenGL ---- */

typedef void any_function(void);
static any_function *(*real_get_proc)(const char *name);
static unsigned (*real_get_error)(void);
static unsigned (*real_get_reset)(void);

static unsigned get_error(void)
{
    unsigned error = real_get_error();
    return STRIKES(gl_errors) ? (unsigned)faults->gl_code : error;
}

static unsigned get_reset(void)
{
    return faults && faults->gl_reset ? (unsigned)faults->gl_reset : real_get_reset();
}

static any_function *get_proc(const char *name)
{
    any_function *real = real_get_proc(name);
    if (real && !strcmp(name, "glGetError")) {
        real_get_error = (unsigned (*)(void))real;
        return (any_function *)get_error;
    }
    if (real && !strcmp(name, "glGetGraphicsResetStatus")) {
        real_get_reset = (unsigned (*)(void))real;
        return (any_function *)get_reset;
    }
    return real;
}

typedef void *dlsym_function(void *library, const char *name);

static dlsym_function *real_dlsym(void)
{
    static const char *const versions[] = {"GLIBC_2.34", "GLIBC_2.17", "GLIBC_2.2.5"};
    static dlsym_function *found;
    for (size_t i = 0; !found && i < sizeof versions / sizeof *versions; i++) {
        void *f = dlvsym(RTLD_NEXT, "dlsym", versions[i]);
        memcpy(&found, &f, sizeof f);
    }
    return found;
}

void *dlsym(void *library, const char *name)
{
    void *real = real_dlsym()(library, name);
    if (!real || (strcmp(name, "eglGetProcAddress") && strcmp(name, "OSMesaGetProcAddress")))
        return real;
    any_function *(*own)(const char *) = get_proc;
    memcpy(&real_get_proc, &real, sizeof real);
    memcpy(&real, &own, sizeof real);
    return real;
}

static void *find(const char *name)
{
    return real_dlsym()(RTLD_NEXT, name);
}
