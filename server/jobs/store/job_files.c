#include "server/jobs/store/job_files.h"
#include "protocol/request.h"
#include "server/base/file.h"
#include "server/base/hash.h"
#include "server/store/quota.h"
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#define FOLDER "jobs"

static int fail(struct pen_error *error)
{
    store_write_failed(errno, error);
    return -1;
}

/* A folder in `parent`, made where it is missing. */
static int open_folder(int parent, const char *name, struct pen_error *error)
{
    if (mkdirat(parent, name, 0700) && errno != EEXIST)
        return fail(error);
    int folder = openat(parent, name, O_RDONLY | O_DIRECTORY | O_CLOEXEC | O_NOFOLLOW);
    return folder < 0 ? fail(error) : folder;
}

int job_files_open_root(const char *store, struct pen_error *error)
{
    int parent = open(store, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (parent < 0)
        return fail(error);
    int root = open_folder(parent, FOLDER, error);
    close(parent);
    return root;
}

int job_files_open(int root, const uint8_t id[PEN_ID_BYTES], struct pen_error *error)
{
    char name[PEN_ID_HEX + 1];
    pen_id_to_hex(id, name);
    return open_folder(root, name, error);
}

static bool measure(int fd, struct job_file *file)
{
    uint8_t digest[PEN_ID_BYTES];
    struct stat status;
    if (fstat(fd, &status) || !S_ISREG(status.st_mode) || !hash_file(fd, digest))
        return false;
    file->bytes = (uint64_t)status.st_size;
    pen_id_to_hex(digest, file->tag);
    return true;
}

static bool put(int fd, const void *data, size_t bytes)
{
    for (size_t at = 0; at < bytes;) {
        ssize_t n = write(fd, (const char *)data + at, bytes - at);
        if (n < 0 && errno != EINTR)
            return false;
        at += n > 0 ? (size_t)n : 0;
    }
    return true;
}

bool job_files_keep(int folder, struct job_file *file, struct pen_error *error)
{
    int fd = openat(folder, JOB_FILES_TEMPORARY, O_RDONLY | O_CLOEXEC | O_NOFOLLOW);
    bool ok = fd >= 0 && measure(fd, file) && !fsync(fd) &&
              !renameat(folder, JOB_FILES_TEMPORARY, folder, file->name) && !fsync(folder);
    if (!ok)
        fail(error);
    if (fd >= 0)
        close(fd);
    return ok;
}

bool job_files_put(int folder, const void *data, size_t bytes, struct pen_error *error)
{
    int fd = openat(
        folder, JOB_FILES_TEMPORARY, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | O_NOFOLLOW, 0600);
    bool ok = fd >= 0 && put(fd, data, bytes);
    if (!ok)
        fail(error);
    if (fd >= 0)
        close(fd);
    return ok;
}

bool job_files_write(
    int folder, struct job_file *file, const void *data, size_t bytes, struct pen_error *error)
{
    bool ok = job_files_put(folder, data, bytes, error) && job_files_keep(folder, file, error);
    if (!ok) /* a full disk needs the room */
        unlinkat(folder, JOB_FILES_TEMPORARY, 0);
    return ok;
}

static DIR *open_dir(int folder)
{
    int copy = openat(folder, ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    DIR *dir = copy >= 0 ? fdopendir(copy) : NULL;
    if (!dir && copy >= 0)
        close(copy);
    return dir;
}

void job_files_tidy(int folder)
{
    DIR *dir = open_dir(folder);
    struct dirent *item;
    while (dir && (item = readdir(dir)))
        if (!strncmp(item->d_name, JOB_FILES_TEMPORARY, strlen(JOB_FILES_TEMPORARY)))
            unlinkat(folder, item->d_name, 0);
    if (dir)
        closedir(dir);
}

int job_files_read(int root, const uint8_t id[PEN_ID_BYTES], const struct job_file *file,
    bool checked, struct pen_error *error)
{
    char path[PEN_ID_HEX + 2 + JOB_NAME_BYTES];
    struct job_file found = {0};
    struct stat status;
    pen_id_to_hex(id, path);
    snprintf(path + PEN_ID_HEX, sizeof path - PEN_ID_HEX, "/%s", file->name);
    int fd = openat(root, path, O_RDONLY | O_CLOEXEC | O_NOFOLLOW);
    bool ok = fd >= 0 && !fstat(fd, &status) && S_ISREG(status.st_mode) &&
              (uint64_t)status.st_size == file->bytes &&
              (!checked || (measure(fd, &found) && !strcmp(found.tag, file->tag)));
    if (ok)
        return fd;
    if (fd >= 0)
        close(fd);
    pen_fail(error, PEN_INTERNAL, "", "This file of the job is damaged or gone.");
    return -1;
}

bool job_files_find(int folder, struct job_file *file)
{
    int fd = openat(folder, file->name, O_RDONLY | O_CLOEXEC | O_NOFOLLOW);
    bool ok = fd >= 0 && measure(fd, file);
    if (fd >= 0)
        close(fd);
    return ok;
}

void job_files_remove(int root, const uint8_t id[PEN_ID_BYTES])
{
    char name[PEN_ID_HEX + 1];
    pen_id_to_hex(id, name);
    file_remove_all(root, name);
}

void job_files_sweep(
    int root, bool (*exists)(void *context, const uint8_t id[PEN_ID_BYTES]), void *context)
{
    DIR *dir = open_dir(root);
    struct dirent *item;
    while (dir && (item = readdir(dir))) {
        uint8_t id[PEN_ID_BYTES];
        if (pen_id_from_hex(item->d_name, id) && !exists(context, id))
            file_remove_all(root, item->d_name);
    }
    if (dir)
        closedir(dir);
}
