#include "server/jobs/keep.h"
#include "server/base/clock.h"
#include "server/jobs/compared.h"
#include "server/jobs/store/job_files.h"
#include "protocol/request.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

bool jobs_keep_frame(struct jobs *j, struct running *r, uint32_t number,
    const struct picture *picture, struct pen_error *error)
{
    struct job_frame frame = {.number = number};
    int folder = job_files_open(j->root, r->job.id, error);
    job_plan_name(r->plan, number, frame.file.name);
    bool ok =
        folder >= 0 && job_files_write(folder, &frame.file, picture->data, picture->size, error);
    if (folder >= 0)
        close(folder);
    if (ok && !r->is_settled) {
        job_plan_settle(&picture->result.completed, r->job.settings, sizeof r->job.settings);
        ok = job_store_set_settings(j->store, r->job.id, r->job.settings, error);
    }
    ok = ok && job_store_add_frame(j->store, r->job.id, &frame, error);
    if (!ok)
        return false;
    r->is_settled = true;
    r->frames[number] = FRAME_DONE;
    __atomic_add_fetch(&r->there, 1, __ATOMIC_RELAXED);
    r->job.bytes += frame.file.bytes;
    j->bytes += frame.file.bytes;
    return true;
}

bool jobs_keep_comparison(
    struct jobs *j, struct running *r, struct compare *compare, struct pen_error *error)
{
    const struct compare_row *rows = compare_rows(compare);
    for (uint32_t i = 0; i < r->job.frames; i++)
        if (r->frames[i] != FRAME_DONE && rows[i].image &&
            !jobs_keep_frame(j, r, i, rows[i].image, error))
            return false;
    char frames[PEN_ID_HEX + 32], id[PEN_ID_HEX + 1];
    pen_id_to_hex(r->job.id, id);
    snprintf(frames, sizeof frames, "/v1/jobs/%s/frames", id);
    double total_ms = clock_ms(clock_now_ns() - r->begun_ns);
    struct compared_extra extra = {
        j->config.makers.catalogue, j->config.cache, NULL, frames, total_ms};
    char *text = compared_document(job_plan_compare(r->plan), rows, &extra);
    int folder = job_files_open(j->root, r->job.id, error);
    struct job_file file = {.name = "result.json"};
    bool ok = folder >= 0 && job_files_write(folder, &file, text, strlen(text), error);
    if (folder >= 0)
        close(folder);
    free(text);
    if (!ok)
        return false;
    r->job.result = file; /* what a method could not render has no image */
    __atomic_store_n(&r->there, r->job.frames, __ATOMIC_RELAXED);
    return true;
}
