#include "server/jobs/archive.h"
#include "protocol/memory.h"
#include "server/jobs/store/job_files.h"
#include <fcntl.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>
#include <webp/mux.h>
#include <zip.h>

#define PATH_BYTES 80

/* libzip wants paths: the folder is what the descriptor says, whatever its name is by now. */
static void path_in(int folder, const char *name, char path[PATH_BYTES])
{
    snprintf(path, PATH_BYTES, "/proc/self/fd/%d/%.40s", folder, name);
}

static bool stopped(const struct archive_job *job, struct pen_error *error)
{
    return !job->is_wanted(job->context) &&
           !pen_fail(error, PEN_UNAVAILABLE, "", "The service is shutting down.");
}

/* ---- zip ---- */

static int is_zip_unwanted(zip_t *zip, void *context)
{
    const struct archive_job *job = context;
    (void)zip;
    return !job->is_wanted(job->context);
}

/* Pictures are compressed already. */
static bool add_to_zip(zip_t *zip, const struct archive_job *job, uint32_t frame)
{
    char name[JOB_NAME_BYTES], path[PATH_BYTES];
    job_plan_name(job->plan, frame, name);
    path_in(job->folder, name, path);
    zip_source_t *source = zip_source_file(zip, path, 0, -1);
    zip_int64_t index = source ? zip_file_add(zip, name, source, ZIP_FL_ENC_UTF_8) : -1;
    if (index < 0) {
        zip_source_free(source);
        return false;
    }
    zip_file_set_mtime(zip, (zip_uint64_t)index, job->time_s, 0);
    return !zip_set_file_compression(zip, (zip_uint64_t)index, ZIP_CM_STORE, 0);
}

static bool write_zip(const struct archive_job *job, struct pen_error *error)
{
    char path[PATH_BYTES];
    path_in(job->folder, JOB_FILES_TEMPORARY, path);
    zip_t *zip = zip_open(path, ZIP_CREATE | ZIP_TRUNCATE, NULL);
    bool ok = zip != NULL;
    for (uint32_t i = 0; ok && i < job->frames; i++)
        ok = add_to_zip(zip, job, i);
    if (zip)
        zip_register_cancel_callback_with_state(zip, is_zip_unwanted, NULL, (void *)job);
    ok = ok && !zip_close(zip);
    if (!ok && zip) {
        pen_fail(
            error, PEN_UNAVAILABLE, "", "The zip cannot be written: %.200s.", zip_strerror(zip));
        zip_discard(zip);
    }
    return ok || pen_fail(error, PEN_UNAVAILABLE, "", "The zip cannot be written.");
}

/* ---- animated WebP ---- */

struct mapping {
    void *data;
    size_t bytes;
};

static bool map_frame(const struct archive_job *job, uint32_t frame, struct mapping *mapping)
{
    char name[JOB_NAME_BYTES];
    struct stat status;
    job_plan_name(job->plan, frame, name);
    int fd = openat(job->folder, name, O_RDONLY | O_CLOEXEC | O_NOFOLLOW);
    bool ok = fd >= 0 && !fstat(fd, &status) && status.st_size > 0;
    void *data =
        ok ? mmap(NULL, (size_t)status.st_size, PROT_READ, MAP_PRIVATE, fd, 0) : MAP_FAILED;
    if (fd >= 0)
        close(fd);
    if (data == MAP_FAILED)
        return false;
    *mapping = (struct mapping){data, (size_t)status.st_size};
    return true;
}

/* When a frame begins, in whole milliseconds, so that rounding does not add up. */
static int begin_ms(const struct archive_job *job, uint32_t frame)
{
    return (int)lround(frame * 1e3 / (double)job_plan_sequence(job->plan)->options.fps);
}

static bool push_frame(
    WebPMux *mux, const struct archive_job *job, uint32_t frame, const struct mapping *mapping)
{
    WebPMuxFrameInfo info = {.bitstream = {mapping->data, mapping->bytes},
        .id = WEBP_CHUNK_ANMF,
        .duration = begin_ms(job, frame + 1) - begin_ms(job, frame),
        .dispose_method = WEBP_MUX_DISPOSE_NONE,
        .blend_method = WEBP_MUX_NO_BLEND};
    return WebPMuxPushFrame(mux, &info, 0) == WEBP_MUX_OK;
}

static bool write_webp(const struct archive_job *job, struct pen_error *error)
{
    struct mapping *mappings = pen_alloc_zero(job->frames, sizeof *mappings);
    WebPMuxAnimParams loops = {.bgcolor = 0, .loop_count = 0};
    WebPData out = {0};
    WebPMux *mux = WebPMuxNew();
    uint64_t sum = 0;
    bool ok = mux != NULL;
    for (uint32_t i = 0; ok && i < job->frames && !stopped(job, error); i++) {
        ok = (map_frame(job, i, &mappings[i]) && push_frame(mux, job, i, &mappings[i])) ||
             pen_fail(error, PEN_INTERNAL, "", "Frame %u is damaged or gone.", i);
        sum += mappings[i].bytes;
        if (sum > ARCHIVE_MOST_WEBP_BYTES)
            ok = pen_fail(error, PEN_TOO_BIG, "/sequence/archive",
                "An animated picture has at most %llu MiB: the frames are there one by one.",
                ARCHIVE_MOST_WEBP_BYTES >> 20);
    }
    ok = ok && !stopped(job, error) && WebPMuxSetAnimationParams(mux, &loops) == WEBP_MUX_OK &&
         WebPMuxAssemble(mux, &out) == WEBP_MUX_OK;
    ok = ok && job_files_put(job->folder, out.bytes, out.size, error);
    WebPDataClear(&out);
    WebPMuxDelete(mux);
    for (uint32_t i = 0; i < job->frames; i++)
        if (mappings[i].data)
            munmap(mappings[i].data, mappings[i].bytes);
    free(mappings);
    return ok || pen_fail(error, PEN_INTERNAL, "", "The animated picture cannot be made.");
}

bool archive_write(
    const struct archive_job *job, char name[JOB_NAME_BYTES], struct pen_error *error)
{
    uint32_t archive = job_plan_sequence(job->plan)->options.archive;
    snprintf(name, JOB_NAME_BYTES, "sequence.%s", pen_archive_names[archive]);
    return archive == PEN_ARCHIVE_WEBP ? write_webp(job, error) : write_zip(job, error);
}
