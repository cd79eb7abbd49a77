#include "clients/cli/output.h"
#include <errno.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static char *volatile guarded; /* the path that is half written */

static void on_signal(int number)
{
    if (guarded)
        unlink(guarded);
    signal(number, SIG_DFL);
    raise(number);
}

void cli_output_guard(void)
{
    static const int signals[] = {SIGINT, SIGTERM, SIGHUP};
    for (size_t i = 0; i < sizeof signals / sizeof *signals; i++)
        if (signal(signals[i], on_signal) == SIG_IGN) /* nohup */
            signal(signals[i], SIG_IGN);
}

int cli_output_fail(const char *path, const char *verb)
{
    int reason = errno;
    struct stat status;
    const char *slash = strrchr(path, '/');
    char *folder = cli_format("%.*s", slash ? (int)(slash - path) : 0, path);
    const char *why = strerror(reason);
    if (reason == EISDIR)
        why = "it is a folder";
    else if (reason == ENOENT && slash && slash > path && stat(folder, &status))
        why = "its folder is not there";
    else if (reason == ENOTDIR)
        why = "what should be its folder is a file";
    free(folder);
    return cli_fail(CLI_FAILED, "%s cannot be %s: %s.", path, verb, why);
}

int cli_output_open(struct cli_output *output, const char *path)
{
    struct stat status;
    *output = (struct cli_output){.path = path};
    if (!strcmp(path, "-")) {
        output->file = stdout;
        return CLI_OK;
    }
    bool folder = !stat(path, &status) && S_ISDIR(status.st_mode);
    errno = EISDIR;
    if (folder || !*path || path[strlen(path) - 1] == '/')
        return cli_output_fail(path, "written");
    output->part = cli_format("%s.part", path);
    guarded = output->part;
    output->file = fopen(output->part, "wb");
    if (output->file)
        return CLI_OK;
    int failed = cli_output_fail(path, "written");
    guarded = NULL;
    free(output->part);
    output->part = NULL;
    return failed;
}

int cli_output_end(struct cli_output *output, int status)
{
    if (!output->file)
        return status;
    FILE *file = output->file;
    bool ok = !ferror(file);
    errno = ok ? 0 : errno;
    if (output->part) {
        ok = !fclose(file) && ok;
        if (ok && status == CLI_OK)
            ok = !rename(output->part, output->path);
    } else
        ok = !fflush(file) && ok;
    if (!ok && status == CLI_OK)
        status = cli_output_fail(output->path, "written");
    if (output->part && status != CLI_OK)
        unlink(output->part);
    guarded = NULL;
    free(output->part);
    *output = (struct cli_output){0};
    return status;
}

int cli_output_folder(const char *path)
{
    struct stat status;
    if (!mkdir(path, 0777))
        return CLI_OK;
    if (errno == EEXIST && !stat(path, &status) && S_ISDIR(status.st_mode))
        return CLI_OK;
    if (errno == EEXIST)
        return cli_fail(CLI_FAILED, "%s cannot be made: there is a file of this name.", path);
    return cli_output_fail(path, "made");
}
