#include "server/uploads/importer.h"
#include "protocol/memory.h"
#include "protocol/request.h"
#include "renderer/import/import_process.h"
#include "server/base/clock.h"
#include "server/base/hash.h"
#include "server/store/describe.h"
#include "server/base/log.h"
#include "server/base/process.h"
#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#define MAX_PROCESSES 64
#define POLL_MS 100 /* how soon a cancellation is noticed */

struct importer {
    struct importer_config config;
    pthread_mutex_t lock; /* guards the queue, closing, stopping and numbers */
    pthread_cond_t work;
    struct import_task *first, *last;
    bool closing, stopping;
    struct importer_numbers numbers;
    pthread_t threads[MAX_PROCESSES];
};

static bool is_closing(struct importer *importer)
{
    pthread_mutex_lock(&importer->lock);
    bool closing = importer->closing;
    pthread_mutex_unlock(&importer->lock);
    return closing;
}

static void count(struct importer *importer, uint64_t *number)
{
    pthread_mutex_lock(&importer->lock);
    ++*number;
    pthread_mutex_unlock(&importer->lock);
}

/* What a finished process means. `report` is what it wrote, `report_bytes` how much. */
static bool judge(struct importer *importer, int status, const struct pen_error *report,
    ssize_t report_bytes, struct pen_error *error)
{
    char text[64];
    bool exited = WIFEXITED(status) && WEXITSTATUS(status) == 0;
    if (exited && report_bytes == (ssize_t)sizeof *report) {
        if (report->code == PEN_OK)
            return true;
        struct pen_error told = *report;
        pen_error_receive(&told);
        return pen_fail(error, told.code, told.pointer, "%s", told.message);
    }
    count(importer, &importer->numbers.crashed);
    log_event(LOG_ERROR, "an importer %s", process_describe(status, text, sizeof text));
    if (WIFSIGNALED(status) && WTERMSIG(status) == SIGKILL)
        return pen_fail(error, PEN_LOST, "", "The import was ended from outside.");
    if (WIFEXITED(status) && (WEXITSTATUS(status) == 126 || WEXITSTATUS(status) == 127))
        return pen_fail(error, PEN_INTERNAL, "", "The importer could not be run.");
    return pen_fail(error, PEN_INVALID, "",
        "The file could not be read: its import crashed or went over its limits.");
}

/* Runs one process over the source; the blob ends up in blob_fd. */
static bool run_process(struct importer *importer, const struct import_task *task, int source_fd,
    int blob_fd, struct pen_error *error)
{
    uint64_t room = store_quota_left(scene_store_quota(importer->config.store));
    const struct importer_config *config = &importer->config;
    char id[PEN_ID_HEX + 1], memory[24], cpu[24], output[24];
    int report_pipe[2];
    pen_id_to_hex(task->id, id);
    snprintf(memory, sizeof memory, "%llu", (unsigned long long)config->memory_bytes >> 20);
    snprintf(cpu, sizeof cpu, "%llu", (unsigned long long)config->cpu_seconds);
    char *arguments[] = {"penumbra-import", "--mode",
        task->kind == STORE_SCENES ? "scene" : "image", "--source-id", id, "--memory-mb", memory,
        "--cpu-seconds", cpu, "--output-bytes", output, NULL};
    snprintf(output, sizeof output, "%llu", (unsigned long long)room);
    if (pipe2(report_pipe, O_CLOEXEC | O_NONBLOCK))
        return pen_fail(error, PEN_UNAVAILABLE, "", "The service is out of descriptors.");
    struct process_fd fds[] = {{source_fd, PEN_IMPORT_SOURCE_FD}, {blob_fd, PEN_IMPORT_OUTPUT_FD},
        {report_pipe[1], PEN_IMPORT_REPORT_FD}};
    struct process process;
    bool ok = process_start(&process, config->import_path, arguments, fds, 3, error);
    close(report_pipe[1]);
    if (ok) {
        uint64_t end = clock_now_ns() + config->timeout_ms * CLOCK_MS;
        int status = 0;
        while (!process_wait(&process, POLL_MS, &status)) {
            bool late = clock_now_ns() > end, closing = is_closing(importer);
            if (!late && !closing)
                continue;
            process_signal(&process, SIGKILL);
            process_wait(&process, -1, &status);
            count(importer, &importer->numbers.timed_out);
            ok = late ? pen_fail(error, PEN_INVALID, "", "The import took too long.")
                      : pen_fail(error, PEN_UNAVAILABLE, "", "The service is shutting down.");
            break;
        }
        struct pen_error report = {0};
        ssize_t n = ok ? read(report_pipe[0], &report, sizeof report) : 0;
        ok = ok && judge(importer, status, &report, n, error);
    }
    close(report_pipe[0]);
    return ok;
}

static bool write_meta(int folder, const char *text)
{
    int fd = openat(folder, STORE_META, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
    size_t bytes = strlen(text);
    bool ok = fd >= 0 && write(fd, text, bytes) == (ssize_t)bytes;
    if (fd >= 0)
        close(fd);
    return ok;
}

/* Source to blob and description, in the staging folder. */
static bool import(struct importer *importer, struct import_task *task,
    struct store_staging *staging, int source_fd)
{
    struct pen_error *error = &task->error;
    char *meta = NULL;
    struct stat status, blob;
    int blob_fd = openat(staging->folder, scene_store_blob_name(task->kind),
        O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
    bool ok = source_fd >= 0 && blob_fd >= 0 && !fstat(source_fd, &status);
    if (!ok)
        store_write_failed(errno, error);
    ok = ok && run_process(importer, task, source_fd, blob_fd, error);
    if (ok && fstat(blob_fd, &blob))
        ok = store_write_failed(errno, error);
    ok = ok && scene_store_claim(importer->config.store, staging,
                   (uint64_t)blob.st_size + STORE_ENTRY_BYTES, error);
    if (ok)
        meta = describe_blob(
            task->kind, task->id, blob_fd, (uint64_t)status.st_size, time(NULL), error);
    ok = ok && meta;
    if (ok && !write_meta(staging->folder, meta))
        ok = store_write_failed(errno, error);
    free(meta);
    if (blob_fd >= 0)
        close(blob_fd);
    return ok;
}

static void add_upload(struct importer *importer, struct import_task *task)
{
    struct scene_store *store = importer->config.store;
    struct store_staging *staging = upload_staging(task->upload);
    uint8_t id[PEN_ID_BYTES];
    if (!upload_finish(task->upload, id, &task->error))
        return;
    if (task->expects_id && memcmp(id, task->id, PEN_ID_BYTES)) {
        char hex[PEN_ID_HEX + 1];
        pen_id_to_hex(id, hex);
        pen_fail(&task->error, PEN_INVALID, "",
            "The SHA-256 of the upload is %s, not what the address says.", hex);
        return;
    }
    memcpy(task->id, id, PEN_ID_BYTES);
    if (scene_store_is_sound(store, task->kind, id))
        return;
    int source_fd = openat(staging->folder, STORE_SOURCE, O_RDONLY | O_CLOEXEC);
    if (import(importer, task, staging, source_fd))
        scene_store_commit(store, task->kind, staging, id, &task->added, &task->error);
    if (source_fd >= 0)
        close(source_fd);
}

/* The source is what its id says, or the entry is lost: what it was made of is gone. */
static bool check_source(struct importer *importer, struct import_task *task, int source_fd)
{
    uint8_t digest[PEN_ID_BYTES];
    if (source_fd >= 0 && !hash_file(source_fd, digest))
        return pen_fail(&task->error, PEN_UNAVAILABLE, "", "The store could not be read.");
    if (source_fd >= 0 && !memcmp(digest, task->id, PEN_ID_BYTES))
        return true;
    bool lost = source_fd >= 0 || task->error.code == PEN_NOT_FOUND;
    if (lost)
        scene_store_lose(importer->config.store, task->kind, task->id);
    return pen_fail(&task->error, PEN_NOT_FOUND, "", "Its source is damaged, too.");
}

static void refresh(struct importer *importer, struct import_task *task)
{
    struct scene_store *store = importer->config.store;
    struct store_staging staging;
    int source_fd = scene_store_open_source(store, task->kind, task->id, &task->error);
    if (check_source(importer, task, source_fd) &&
        scene_store_stage(store, &staging, &task->error)) {
        if (import(importer, task, &staging, source_fd))
            scene_store_refresh(store, task->kind, &staging, task->id, &task->error);
        else
            scene_store_discard(store, &staging);
    }
    if (task->error.code)
        scene_store_not_refreshed(
            store, task->kind, task->id, pen_code_blame(task->error.code) == PEN_BLAME_CALLER);
    if (source_fd >= 0)
        close(source_fd);
}

static void *run(void *argument)
{
    struct importer *importer = argument;
    for (;;) {
        pthread_mutex_lock(&importer->lock);
        while (!importer->first && !importer->stopping)
            pthread_cond_wait(&importer->work, &importer->lock);
        struct import_task *task = importer->first;
        if (task) {
            importer->first = task->next;
            if (!importer->first)
                importer->last = NULL;
            importer->numbers.waiting--;
            importer->numbers.running++;
        }
        pthread_mutex_unlock(&importer->lock);
        if (!task)
            return NULL;
        uint64_t start = clock_now_ns();
        if (is_closing(importer))
            pen_fail(&task->error, PEN_UNAVAILABLE, "", "The service is shutting down.");
        else if (task->upload)
            add_upload(importer, task);
        else
            refresh(importer, task);
        upload_destroy(task->upload);
        task->upload = NULL;
        task->ms = clock_ms(clock_now_ns() - start);
        pthread_mutex_lock(&importer->lock);
        importer->numbers.running--;
        importer->numbers.done += task->error.code == PEN_OK;
        importer->numbers.failed += task->error.code != PEN_OK;
        pthread_mutex_unlock(&importer->lock);
        task->finish(task);
    }
}

struct importer *importer_create(const struct importer_config *config)
{
    struct importer *importer = pen_alloc_zero(1, sizeof *importer);
    importer->config = *config;
    pthread_mutex_init(&importer->lock, NULL);
    pthread_cond_init(&importer->work, NULL);
    for (uint32_t i = 0; i < config->processes; i++)
        if (pthread_create(&importer->threads[i], NULL, run, importer))
            abort();
    return importer;
}

bool importer_submit(struct importer *importer, struct import_task *task, struct pen_error *error)
{
    bool ok = true;
    pthread_mutex_lock(&importer->lock);
    if (importer->closing) {
        ok = pen_fail(error, PEN_UNAVAILABLE, "", "The service is shutting down.");
    } else if (task->upload && importer->numbers.waiting >= importer->config.queue_limit) {
        ok = pen_fail(error, PEN_UNAVAILABLE, "", "Too many uploads wait for their import.");
    } else {
        task->next = NULL;
        if (importer->last)
            importer->last->next = task;
        else
            importer->first = task;
        importer->last = task;
        importer->numbers.waiting++;
        pthread_cond_signal(&importer->work);
    }
    pthread_mutex_unlock(&importer->lock);
    return ok;
}

void importer_cancel(struct importer *importer)
{
    pthread_mutex_lock(&importer->lock);
    importer->closing = true;
    pthread_cond_broadcast(&importer->work);
    pthread_mutex_unlock(&importer->lock);
}

void importer_stop(struct importer *importer)
{
    importer_cancel(importer);
    pthread_mutex_lock(&importer->lock);
    bool runs = !importer->stopping;
    importer->stopping = true;
    pthread_cond_broadcast(&importer->work);
    pthread_mutex_unlock(&importer->lock);
    for (uint32_t i = 0; runs && i < importer->config.processes; i++)
        pthread_join(importer->threads[i], NULL);
}

void importer_destroy(struct importer *importer)
{
    if (!importer)
        return;
    importer_stop(importer);
    pthread_mutex_destroy(&importer->lock);
    pthread_cond_destroy(&importer->work);
    free(importer);
}

void importer_read(struct importer *importer, struct importer_numbers *numbers)
{
    pthread_mutex_lock(&importer->lock);
    *numbers = importer->numbers;
    pthread_mutex_unlock(&importer->lock);
}
