#include "server/jobs/store/job_json.h"
#include "protocol/request.h"
#include "server/base/status.h"
#include <stdio.h>
#include <stdlib.h>

static void write_link(struct pen_json *json, const char *key, const char *id, const char *rest)
{
    char link[PEN_ID_HEX + 32];
    snprintf(link, sizeof link, "/v1/jobs/%s%s", id, rest);
    pen_json_link(json, key, link);
}

void job_write(struct pen_json *json, const char *key, const struct job *job)
{
    char id[PEN_ID_HEX + 1];
    pen_id_to_hex(job->id, id);
    pen_json_object(json, key);
    pen_json_id(json, "id", job->id);
    pen_json_string(json, "kind", job_kind_names[job->kind]);
    pen_json_string(json, "state", job_state_names[job->state]);
    pen_json_id(json, "scene", job->scene);
    pen_json_int(json, "created_unix_s", job->created_s);
    if (job_is_over(job->state)) {
        pen_json_int(json, "ended_unix_s", job->ended_s);
        pen_json_int(json, "expires_unix_s", job->expires_s);
    }
    pen_json_double(
        json, "progress", job->state == JOB_SUCCESSFUL ? 1 : (double)job->done / job->frames);
    pen_json_object(json, "frames");
    pen_json_uint(json, "total", job->frames);
    pen_json_uint(json, "done", job->done);
    pen_json_uint(json, "failed", job->state == JOB_FAILED && job->done < job->frames);
    pen_json_end(json);
    pen_json_uint(json, "bytes", job->bytes);
    if (job->state == JOB_FAILED) {
        char *problem = http_problem(&job->error, NULL);
        pen_json_raw(json, "error", problem);
        free(problem);
    }
    pen_json_object(json, "links");
    write_link(json, "self", id, "");
    write_link(json, "events", id, "/events");
    write_link(json, "frames", id, "/frames");
    if (*job->result.name || (job->kind == JOB_RENDER && job->state == JOB_SUCCESSFUL))
        write_link(json, "result", id, "/result");
    pen_json_end(json);
    pen_json_end(json);
}

char *job_json(const struct job *job)
{
    struct pen_json json = {0};
    job_write(&json, NULL, job);
    return pen_json_finish(&json, NULL);
}
