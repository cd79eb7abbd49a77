#include "server/jobs/job_plan.h"
#include "protocol/json_request.h"
#include "protocol/json_sequence.h"
#include "protocol/memory.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct job_plan {
    enum job_kind kind;
    uint8_t scene[PEN_ID_BYTES];
    struct pen_request request;     /* JOB_RENDER */
    struct pen_sequence *sequence;  /* JOB_SEQUENCE */
    struct pen_compare *comparison; /* JOB_COMPARE */
};

/* As long as it takes, behind who waits for an answer; nobody but the job gets what is cut short. */
static void make_batch(struct pen_delivery *delivery)
{
    delivery->priority = PEN_PRIORITY_BATCH;
    delivery->on_deadline = PEN_DEADLINE_ERROR;
    delivery->progressive.on = 0;
    memset(delivery->session, 0, sizeof delivery->session);
}

static bool read_body(struct job_plan *plan, const struct job_plan_makers *makers, const char *body,
    size_t bytes, struct pen_error *error)
{
    switch (plan->kind) {
    case JOB_RENDER:
        return pen_request_from_json(body, bytes, makers->catalogue, &plan->request, error);
    case JOB_COMPARE:
        plan->comparison = pen_alloc_zero(1, sizeof *plan->comparison);
        return pen_compare_from_json(
            body, bytes, makers->catalogue, makers->open_method, plan->comparison, error);
    default:
        plan->sequence = pen_sequence_from_json(
            body, bytes, makers->catalogue, makers->open_method, true, error);
        return plan->sequence != NULL;
    }
}

struct job_plan *job_plan_create(const struct job_plan_makers *makers, enum job_kind kind,
    const uint8_t scene[PEN_ID_BYTES], const char *body, size_t bytes, struct pen_error *error)
{
    struct job_plan *plan = pen_alloc_zero(1, sizeof *plan);
    plan->kind = kind;
    if (!read_body(plan, makers, body, bytes, error)) {
        job_plan_destroy(plan);
        return NULL;
    }
    memcpy(plan->scene, plan->sequence ? plan->sequence->request.scene : scene, PEN_ID_BYTES);
    for (uint32_t i = 0; plan->comparison && i <= plan->comparison->count; i++) {
        memcpy(plan->comparison->requests[i].scene, plan->scene, PEN_ID_BYTES);
        make_batch(&plan->comparison->requests[i].delivery);
    }
    return plan;
}

void job_plan_destroy(struct job_plan *plan)
{
    if (!plan)
        return;
    pen_sequence_destroy(plan->sequence);
    free(plan->comparison);
    free(plan);
}

const uint8_t *job_plan_scene(const struct job_plan *plan)
{
    return plan->scene;
}

uint32_t job_plan_frames(const struct job_plan *plan)
{
    return plan->sequence     ? plan->sequence->options.frames
           : plan->comparison ? 1 + plan->comparison->count
                              : 1;
}

void job_plan_request(
    const struct job_plan *plan, uint32_t frame, const char *settings, struct pen_request *request)
{
    float exposure_ev, sky_level;
    if (plan->sequence)
        pen_sequence_frame(plan->sequence, frame, request);
    else
        *request = plan->comparison ? plan->comparison->requests[frame] : plan->request;
    memcpy(request->scene, plan->scene, PEN_ID_BYTES);
    make_batch(&request->delivery);
    if (sscanf(settings, "%f %f", &exposure_ev, &sky_level) != 2)
        return;
    if (request->exposure_ev == PEN_AUTO)
        request->exposure_ev = exposure_ev;
    if (request->sky_level == PEN_AUTO)
        request->sky_level = sky_level;
}

/* Exposure depends on scene and lights, not on the camera, and of an animation on its brightest
 * moment: it is steady of itself unless the lights move. */
bool job_plan_needs_settings(const struct job_plan *plan)
{
    return plan->sequence && pen_sequence_moves_lights(plan->sequence) &&
           (plan->sequence->request.exposure_ev == PEN_AUTO ||
               plan->sequence->request.sky_level == PEN_AUTO);
}

void job_plan_settle(const struct pen_request *completed, char *settings, size_t bytes)
{
    snprintf(
        settings, bytes, "%.9g %.9g", (double)completed->exposure_ev, (double)completed->sky_level);
}

void job_plan_name(const struct job_plan *plan, uint32_t frame, char name[JOB_NAME_BYTES])
{
    struct pen_request request;
    job_plan_request(plan, frame, "", &request);
    snprintf(name, JOB_NAME_BYTES, "%06u.%.5s", frame, pen_format_names[request.output.format]);
}

const struct pen_compare *job_plan_compare(const struct job_plan *plan)
{
    return plan->comparison;
}

const struct pen_sequence *job_plan_sequence(const struct job_plan *plan)
{
    return plan->sequence;
}
