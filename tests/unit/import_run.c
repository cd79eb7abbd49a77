#include "tests/unit/import_run.h"
#include "renderer/import/import_process.h"
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#define SOURCE_ID "00112233445566778899aabbccddeeff00112233445566778899aabbccddeeff"

static double seconds(struct timeval t)
{
    return (double)t.tv_sec + 1e-6 * (double)t.tv_usec;
}

static bool is_image(const char *path)
{
    const char *dot = strrchr(path, '.');
    return dot && (!strcmp(dot, ".png") || !strcmp(dot, ".jpg") || !strcmp(dot, ".webp"));
}

static void become_importer(const int from[3], const char *mode, const char *option)
{
    int high[3]; /* out of the way of the numbers that the importer expects */
    for (int i = 0; i < 3; i++)
        high[i] = fcntl(from[i], F_DUPFD, 64);
    for (int i = 0; i < 3; i++)
        dup2(high[i], PEN_IMPORT_SOURCE_FD + i);
    for (int fd = PEN_IMPORT_REPORT_FD + 1; fd < 128; fd++)
        close(fd);
    execl(IMPORTER, IMPORTER, "--mode", mode, "--source-id", SOURCE_ID, option, (char *)NULL);
    _exit(127);
}

struct run run_importer(const char *path, const char *option)
{
    struct run run = {.status = -1};
    int report[2], source = open(path, O_RDONLY), output = memfd_create("blob", 0);
    if (source < 0 || output < 0 || pipe(report))
        return run;
    pid_t pid = fork();
    if (pid == 0)
        become_importer(
            (const int[3]){source, output, report[1]}, is_image(path) ? "image" : "scene", option);
    close(report[1]);
    char bytes[2 * sizeof run.error];
    size_t got = 0;
    for (ssize_t n; (n = read(report[0], bytes + got, sizeof bytes - got)) > 0;)
        got += (size_t)n;
    struct rusage usage;
    wait4(pid, &run.status, 0, &usage);
    run.seconds = seconds(usage.ru_utime) + seconds(usage.ru_stime);
    run.memory_mb = usage.ru_maxrss / 1024;
    run.reported = got == sizeof run.error;
    if (run.reported)
        memcpy(&run.error, bytes, sizeof run.error);
    struct stat size;
    if (!fstat(output, &size) && size.st_size) {
        run.blob_bytes = (size_t)size.st_size;
        run.blob = malloc(run.blob_bytes);
        if (pread(output, run.blob, run.blob_bytes, 0) != size.st_size)
            run.blob_bytes = 0;
    }
    close(report[0]);
    close(source);
    close(output);
    return run;
}
