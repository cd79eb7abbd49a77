/* A job of which something is shown: its other threads trace on meanwhile, but while they are held, and it
 * ends as it does when nobody looks. */
#include "tests/unit/trace_fixture.h"
#include <time.h>

#define EDGE 160
#define PIXELS (EDGE * EDGE)
#define SAMPLES 512
#define WINDOW_MS 200 /* others get their share of it, however busy they are */
#define PATIENCE 200  /* times that */

static float positions[PIXELS][3], normals[PIXELS][3];

struct onlooker {
    uint32_t shows;
    bool traced_on, stood_still, leaves;
};

static double processor_ms(clockid_t clock)
{
    struct timespec t;
    clock_gettime(clock, &t);
    return 1e3 * (double)t.tv_sec + 1e-6 * (double)t.tv_nsec;
}

/* Of all threads but this one, in WINDOW_MS. */
static double others_worked(void)
{
    double all = processor_ms(CLOCK_PROCESS_CPUTIME_ID),
           own = processor_ms(CLOCK_THREAD_CPUTIME_ID);
    nanosleep(&(struct timespec){0, WINDOW_MS * 1000000}, NULL);
    return processor_ms(CLOCK_PROCESS_CPUTIME_ID) - all -
           (processor_ms(CLOCK_THREAD_CPUTIME_ID) - own);
}

/* Whether that happens at some time. */
static bool see(bool work)
{
    for (int i = 0; i < PATIENCE; i++)
        if ((others_worked() > 1) == work)
            return true;
    return false;
}

static bool turn(void *context)
{
    (void)context;
    return true;
}

static enum pen_trace_step step(void *context, uint32_t done, uint32_t total)
{
    const struct onlooker *o = context;
    return 2 * done >= total && !o->shows ? PEN_TRACE_SHOW : PEN_TRACE_GO_ON;
}

static bool show(void *context)
{
    struct onlooker *o = context;
    o->shows++;
    return true;
}

static bool shown(void *context, struct pen_trace_crew *crew)
{
    struct onlooker *o = context;
    if (o->leaves)
        return false;
    crew->hold(crew, true);
    o->stood_still = see(false);
    crew->hold(crew, false);
    o->traced_on = see(true);
    return true;
}

int main(void)
{
    static float plain[PIXELS][4], watched[PIXELS][4];
    struct psc_builder *builder = psc_builder_create();
    for (int i = 0; i < 8; i++) {
        float x[2] = {0.25f * (float)i - 1, 0.25f * (float)i - 0.9f}, z[2] = {-1, 1};
        add_rectangle(builder, x, z, 1, false, add_plain_material(builder, true), identity);
    }
    struct pen_trace_scene *scene = finish_scene(builder, NULL);
    for (int i = 0; i < PIXELS; i++) {
        positions[i][0] = 2 * (float)(i % EDGE) / EDGE - 1;
        positions[i][2] = 2 * (float)(i / EDGE) / EDGE - 1;
        normals[i][1] = 1;
    }
    struct pen_trace_light light = downward_light(PEN_TRACE_RECT, 0.5f);
    struct pen_trace_job job = {.positions = positions[0],
        .normals = normals[0],
        .width = EDGE,
        .height = EDGE,
        .samples = SAMPLES,
        .seed = 3};
    struct pen_error error = {0};
    CHECK(pen_trace_visibility(
        scene, &light, &job, &(struct pen_trace_result){.visibility = plain[0]}, NULL, &error));
    struct onlooker o = {.shows = 0};
    job.threads = 2;
    job.turn = turn, job.turn_ms = 25;
    job.turn_context = &o;
    job.step = step, job.show = show, job.shown = shown;
    CHECK(pen_trace_visibility(
        scene, &light, &job, &(struct pen_trace_result){.visibility = watched[0]}, NULL, &error));
    CHECK(o.shows == 1 && o.stood_still && o.traced_on);
    CHECK(!memcmp(plain, watched, sizeof plain));
    o = (struct onlooker){.leaves = true};
    CHECK(!pen_trace_visibility(
        scene, &light, &job, &(struct pen_trace_result){.visibility = watched[0]}, NULL, &error));
    pen_trace_scene_destroy(scene);
    CHECK_DONE();
}
