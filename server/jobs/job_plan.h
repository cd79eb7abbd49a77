/* What a job's body asks for, frame by frame. */
#pragma once
#include "protocol/json_compare.h"
#include "protocol/json_sequence.h"
#include "server/jobs/store/job_store.h"

struct job_plan_makers {
    const struct pen_catalogue *catalogue;
    const char
        *open_method; /* the one that stands for another, for which nothing can be compared and
                                whose frames would differ from run to run */
};

struct job_plan;
/* `body` as the client sent it: the same again gives the same plan. Errors: those of a request. */
struct job_plan *job_plan_create(const struct job_plan_makers *makers, enum job_kind kind,
    const uint8_t scene[PEN_ID_BYTES], const char *body, size_t bytes, struct pen_error *error);
void job_plan_destroy(struct job_plan *plan); /* NULL is fine */

const uint8_t *job_plan_scene(const struct job_plan *plan);
uint32_t job_plan_frames(const struct job_plan *plan);
/* `settings`: of the job; "": none. */
void job_plan_request(
    const struct job_plan *plan, uint32_t frame, const char *settings, struct pen_request *request);
/* Where the first frame says what holds for all: what it found, for the job. False: it need not. */
bool job_plan_needs_settings(const struct job_plan *plan);
void job_plan_settle(const struct pen_request *completed, char *settings, size_t bytes);
/* What a frame's file is called. */
void job_plan_name(const struct job_plan *plan, uint32_t frame, char name[JOB_NAME_BYTES]);
/* NULL where it is of another kind. */
const struct pen_compare *job_plan_compare(const struct job_plan *plan);
const struct pen_sequence *job_plan_sequence(const struct job_plan *plan);
