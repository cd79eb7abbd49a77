/* claims [--device D] [--out DIR] < PLAN: renders, times and compares what the plan (plan.h) asks
 * for. Prints one line of JSON per group; pictures go to DIR. The first line describes the device.
 *
 * Times are comparable within a group only: its variants take turns, so that whatever else the
 * machine does falls on all of them, and the reader takes ratios within one round. Every timed
 * image has its light elsewhere by a hair, so that shadow inputs are made anew as for a moving
 * light or scene. */
#include "tests/bench/claims/compare.h"
#include "tests/bench/claims/plan.h"
#include <getopt.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define MAX_ROUNDS 64
#define SLOW_SHARE 6 /* a variant whose image takes this part of the group's time is slow */
#define FEW_ROUNDS 5
#define SETTLED 0.02f /* quartiles this near to the median: more rounds would tell nothing new */

struct timing {
    uint32_t rounds;
    float ms[PEN_STAGES][MAX_ROUNDS];
    struct pen_pass_time passes[PEN_MAX_PASSES]; /* ms: of pass_ms, their median */
    float pass_ms[PEN_MAX_PASSES][MAX_ROUNDS];
    uint32_t pass_count;
    uint32_t reused; /* images whose shadow inputs were kept */
};

static struct pen_renderer *renderer;
static const char *out_folder;

static void die(const char *what, const struct pen_error *error)
{
    fprintf(stderr, "claims: %s: %s\n", what, error->message);
    exit(1);
}

static double seconds_now(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static int compare_floats(const void *a, const void *b)
{
    float x = *(const float *)a, y = *(const float *)b;
    return x < y ? -1 : x > y;
}

/* Renders one layer with the settings of the variant and keeps its pixels. */
static bool take(struct plan_variant *variant, uint32_t layer, uint32_t format, void **pixels,
    struct pen_result *result)
{
    struct pen_request request = variant->request;
    struct pen_frame frame;
    request.output = (struct pen_output){
        .layer = layer, .format = format, .bit_depth = format == PEN_EXR ? 32 : 8, .quality = 90};
    if (!pen_renderer_render(renderer, &request, &frame, result, &variant->error))
        return false;
    *pixels = frame.planes[0].data;
    frame.planes[0].data = NULL;
    pen_frame_finish(&frame);
    return true;
}

static void take_pictures(struct plan_variant *variant, struct picture *picture)
{
    picture->width = variant->request.width, picture->height = variant->request.height;
    void *visibility = NULL, *beauty = NULL;
    double began = seconds_now();
    bool ok = take(variant, PEN_LAYER_VISIBILITY, PEN_EXR, &visibility, &picture->result);
    picture->seconds = seconds_now() - began;
    struct pen_result unused;
    ok = ok && take(variant, PEN_LAYER_BEAUTY, PEN_PNG, &beauty, &unused);
    picture->visibility = visibility, picture->beauty = beauty;
    if (!ok)
        variant->status = VARIANT_FAILED;
}

static void store_times(struct timing *timing, const struct pen_result *result)
{
    uint32_t r = timing->rounds++;
    timing->pass_count = result->pass_count;
    timing->reused += result->shadow_inputs_reused != 0;
    for (uint32_t s = 0; s < PEN_STAGES; s++)
        timing->ms[s][r] = 0;
    for (uint32_t p = 0; p < result->pass_count; p++) {
        timing->passes[p] = result->passes[p];
        timing->pass_ms[p][r] = result->passes[p].ms;
        timing->ms[result->passes[p].stage][r] += result->passes[p].ms;
    }
}

/* One image for its times. `turn` tells lights apart. */
static bool time_one(struct plan_variant *variant, const struct pen_result *first, uint32_t turn,
    struct timing *timing)
{
    static struct pen_result result;
    struct pen_request request = variant->request;
    struct pen_frame frame;
    request.output = (struct pen_output){.layer = PEN_LAYER_BEAUTY, .bit_depth = 8, .quality = 90};
    request.lights_given = 1;
    request.light_count = first->completed.light_count;
    memcpy(request.lights, first->completed.lights, sizeof request.lights);
    for (uint32_t i = 0; i < request.light_count; i++) {
        for (int k = 0; k < 3; k++)
            request.lights[i].position[k] *= 1 + 3e-7f * (float)(turn % 1000);
        /* The automatic light of a scene in millimetres is stronger than a request may ask for. */
        request.lights[i].power_w = fminf(request.lights[i].power_w, 1e9f);
    }
    pen_renderer_drop_views(renderer); /* as if the camera moved */
    if (!pen_renderer_render(renderer, &request, &frame, &result, &variant->error)) {
        variant->status = VARIANT_FAILED;
        return false;
    }
    pen_frame_finish(&frame);
    if (timing)
        store_times(timing, &result);
    return true;
}

static double frame_seconds(const struct pen_result *result)
{
    double ms = 0;
    for (uint32_t p = 0; p < result->pass_count; p++)
        ms += (double)result->passes[p].ms;
    return ms / 1000;
}

/* Whether the middle half of an image's times lies close to their median. */
static bool is_settled(const struct timing *timing)
{
    float totals[MAX_ROUNDS];
    uint32_t n = timing->rounds;
    for (uint32_t r = 0; r < n; r++) {
        totals[r] = 0;
        for (uint32_t s = 0; s < PEN_STAGES; s++)
            if (s != PEN_STAGE_READBACK)
                totals[r] += timing->ms[s][r];
    }
    qsort(totals, n, sizeof *totals, compare_floats);
    return totals[3 * n / 4] - totals[n / 4] <= 2 * SETTLED * totals[n / 2];
}

static bool all_settled(const struct plan_group *group, const struct timing *timings)
{
    for (uint32_t i = 0; i < group->variant_count; i++)
        if (timings[i].rounds > 1 && !is_settled(&timings[i]))
            return false;
    return true;
}

/* Interleaved rounds over all variants that work, after one round of warming up. Slow ones take
 * part in a single round, cold: to them warming up matters little. `kept`, when not NULL: of the
 * same image right after, for which shadow inputs need not be made again. */
static void time_group(struct plan_group *group, const struct picture *pictures,
    struct timing *moving, struct timing *kept)
{
    static uint32_t turn;
    double began = seconds_now(), slow = group->seconds / SLOW_SHARE;
    uint32_t rounds = group->repetitions < MAX_ROUNDS ? group->repetitions : MAX_ROUNDS;
    for (uint32_t round = 0; round <= rounds; round++) {
        if (round > 2 && seconds_now() - began > group->seconds)
            break;
        if (round > FEW_ROUNDS && all_settled(group, moving))
            break;
        for (uint32_t i = 0; i < group->variant_count; i++) {
            struct plan_variant *variant = &group->variants[i];
            if (variant->status != VARIANT_OK || !strcmp(variant->name, "reference") ||
                (frame_seconds(&pictures[i].result) > slow && round != 1))
                continue;
            const struct pen_result *first = &pictures[i].result;
            if (time_one(variant, first, ++turn, round ? &moving[i] : NULL) && kept)
                time_one(variant, first, turn, round ? &kept[i] : NULL);
        }
    }
}

static void write_times(struct pen_json *json, const char *key, struct timing *timing)
{
    pen_json_object(json, key);
    for (uint32_t s = PEN_STAGE_GBUFFER; s <= PEN_STAGE_READBACK; s++)
        pen_json_floats(json, pen_stage_names[s], timing->ms[s], timing->rounds);
    pen_json_uint(json, "inputs_kept", timing->reused);
    pen_json_array(json, "passes");
    for (uint32_t p = 0; p < timing->pass_count; p++) {
        const struct pen_pass_time *pass = &timing->passes[p];
        qsort(timing->pass_ms[p], timing->rounds, sizeof(float), compare_floats);
        pen_json_object(json, NULL);
        pen_json_string(json, "stage", pen_stage_names[pass->stage]);
        pen_json_string(json, "name", pass->name);
        pen_json_uint(json, "count", pass->count);
        pen_json_float(json, "ms", timing->pass_ms[p][timing->rounds / 2]);
        pen_json_end(json);
    }
    pen_json_end(json);
    pen_json_end(json);
}

static void write_variant(struct pen_json *json, const struct plan_group *group, uint32_t i,
    const struct picture *picture, struct timing *moving, struct timing *kept)
{
    static const char *const states[] = {"ok", "not built", "failed"};
    const struct plan_variant *variant = &group->variants[i];
    pen_json_object(json, NULL);
    pen_json_string(json, "name", variant->name);
    pen_json_string(json, "settings", variant->settings);
    pen_json_string(json, "status", states[variant->status]);
    if (variant->status == VARIANT_FAILED)
        pen_json_string(json, "message", variant->error.message);
    if (variant->status == VARIANT_OK) {
        const struct pen_result *result = &picture->result;
        pen_json_double(json, "first_s", picture->seconds);
        pen_json_uint(json, "full_work_pixels", result->full_work_pixels);
        pen_json_array(json, "subdivided_pixels");
        for (int k = 0; k < 2; k++)
            pen_json_uint(json, NULL, result->subdivided_pixels[k]);
        pen_json_end(json);
        pen_json_uint(json, "shadow_maps", result->shadow_maps);
        pen_json_uint(json, "gpu_bytes", result->gpu_bytes);
        pen_json_array(json, "warnings");
        for (uint32_t w = 0; w < result->warning_count; w++)
            pen_json_string(json, NULL, result->warnings[w]);
        pen_json_end(json);
        if (moving->rounds)
            write_times(json, "moving", moving);
        if (kept->rounds)
            write_times(json, "kept", kept);
    }
    pen_json_end(json);
}

static void write_light(struct pen_json *json, const struct pen_light *light)
{
    pen_json_object(json, "light");
    pen_json_string(json, "type", pen_light_type_names[light->type]);
    pen_json_doubles(json, "position", light->position, 3);
    pen_json_doubles(json, "target", light->target, 3);
    pen_json_float(json, "width", light->width);
    pen_json_float(json, "height", light->height);
    pen_json_float(json, "radius", light->radius);
    pen_json_end(json);
}

static void print_line(struct pen_json *json)
{
    char *text = pen_json_finish(json, NULL);
    puts(text);
    fflush(stdout);
    free(text);
}

static void write_group(struct plan_group *group, const struct picture *pictures,
    struct timing *moving, struct timing *kept)
{
    struct pen_json json = {0};
    pen_json_object(&json, NULL);
    pen_json_string(&json, "group", group->name);
    pen_json_string(&json, "scene", group->scene->name);
    pen_json_string(&json, "settings", group->settings);
    for (uint32_t i = 0; i < group->variant_count; i++)
        if (group->variants[i].status == VARIANT_OK) {
            pen_json_uint(&json, "triangles", pictures[i].result.triangles_drawn);
            pen_json_uint(&json, "width", pictures[i].width);
            pen_json_uint(&json, "height", pictures[i].height);
            write_light(&json, &pictures[i].result.completed.lights[0]);
            break;
        }
    pen_json_array(&json, "variants");
    for (uint32_t i = 0; i < group->variant_count; i++)
        write_variant(&json, group, i, &pictures[i], &moving[i], &kept[i]);
    pen_json_end(&json);
    pen_json_array(&json, "comparisons");
    bool flip = strchr(group->flags, 'f');
    for (uint32_t i = 1; i < group->variant_count; i++)
        if (!strcmp(group->variants[0].name, "reference"))
            compare_write(&json, group, pictures, i, 0, flip);
    for (uint32_t p = 0; p < group->pair_count; p++)
        compare_write(&json, group, pictures, group->pairs[p][0], group->pairs[p][1], flip);
    pen_json_end(&json);
    pen_json_end(&json);
    print_line(&json);
}

static void run_group(struct plan_group *group)
{
    struct pen_error error = {0};
    struct picture *pictures = calloc(group->variant_count, sizeof *pictures);
    struct timing *timings = calloc(2 * group->variant_count, sizeof *timings);
    if (!pictures || !timings)
        abort();
    double began = seconds_now();
    if (!pen_renderer_load_scene(renderer, group->scene->id, plan_scene_open(group->scene), &error))
        die(group->scene->name, &error);
    for (uint32_t i = 0; i < group->variant_count; i++)
        if (group->variants[i].status == VARIANT_OK)
            take_pictures(&group->variants[i], &pictures[i]);
    struct timing *kept = timings + group->variant_count;
    if (group->repetitions)
        time_group(group, pictures, timings, strchr(group->flags, 'k') ? kept : NULL);
    write_group(group, pictures, timings, kept);
    if (out_folder && strpbrk(group->flags, "pv"))
        compare_pictures(out_folder, group, pictures);
    for (uint32_t i = 0; i < group->variant_count; i++) {
        free(pictures[i].visibility);
        free(pictures[i].beauty);
    }
    free(pictures);
    free(timings);
    fprintf(stderr, "%s on %s: %.1f s\n", group->name, group->scene->name, seconds_now() - began);
}

static void write_device(void)
{
    const struct pen_device_info *device = pen_renderer_device(renderer);
    struct pen_json json = {0};
    pen_json_object(&json, NULL);
    pen_json_string(&json, "device", device->renderer);
    pen_json_string(&json, "gl", device->version);
    pen_json_bool(&json, "software", device->software);
    pen_json_array(&json, "methods");
    const struct pen_catalogue *catalogue = pen_renderer_catalogue();
    for (uint32_t i = 0; i < catalogue->count; i++) {
        pen_json_object(&json, NULL);
        pen_json_string(&json, "name", catalogue->items[i]->name);
        pen_json_string(&json, "title", catalogue->items[i]->title);
        pen_json_string(&json, "citation", catalogue->items[i]->citation);
        pen_json_string(&json, "artefacts", catalogue->items[i]->artefacts);
        pen_json_bool(&json, "textured", catalogue->items[i]->textured);
        pen_json_end(&json);
    }
    pen_json_end(&json);
    pen_json_end(&json);
    print_line(&json);
}

int main(int argc, char **argv)
{
    static const struct option options[] = {
        {"device", required_argument, NULL, 'd'}, {"out", required_argument, NULL, 'o'}, {0}};
    struct pen_renderer_config config = {.gpu_memory_bytes = 4ull << 30};
    for (int c; (c = getopt_long(argc, argv, "", options, NULL)) >= 0;) {
        int device = c == 'd' ? pen_choice_index(pen_device_choice_names, optarg) : 0;
        if (c == '?' || device < 0) {
            fprintf(stderr, "usage: %s [--device auto|gpu|surfaceless|osmesa] [--out DIR] < PLAN\n",
                argv[0]);
            return 2;
        }
        if (c == 'd')
            config.device.choice = (uint32_t)device;
        else
            out_folder = optarg;
    }
    struct pen_error error = {0};
    if (!(renderer = pen_renderer_create(&config, &error))) {
        fprintf(stderr, "skipped: %s\n", error.message);
        return 77;
    }
    write_device();
    static struct plan_group group;
    while (plan_next(stdin, &group))
        run_group(&group);
    pen_renderer_destroy(renderer);
    return 0;
}
