/* penumbra-bench: what every method and every pass costs, without a daemon. Needs the renderer, a C
 * compiler and EGL only. See usage(). */
#include "renderer/generate/generate.h"
#include "renderer/renderer.h"
#include "tests/bench/growth.h"
#include <fcntl.h>
#include <getopt.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <time.h>
#include <unistd.h>

#define MAX_RUNS 256
#define MAX_VALUES 16
#define MAX_POINTS 4096

struct options {
    const char *scene, *techniques, *json;
    uint32_t runs, warm_up, device;
    double seconds, limit;
    bool moving_light; /* shadow inputs are rebuilt for every image */
    /* Axes; each is swept alone, the others stay at their first value. */
    double values[AXES][MAX_VALUES];
    uint32_t counts[AXES];
};

struct sample {
    const char *method;
    uint32_t width, runs;
    double at[AXES];                             /* what was measured; triangles: drawn */
    float median_ms, low_ms, high_ms;            /* of the whole image; quartiles */
    struct pen_pass_time passes[PEN_MAX_PASSES]; /* ms: medians */
    uint32_t pass_count;
    char error[128];
};

static struct growth_point points[MAX_POINTS];
static uint32_t point_count;
static bool time_is_up;

static double seconds_now(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static void usage(void)
{
    puts(
        "penumbra-bench [options]\n"
        "Times every method and every pass. A list's first value is the base; each axis leaves it\n"
        "on its own.\n"
        "  --scene NAME|FILE.pscene  demo, hairball, foliage, columns, ... or an imported scene\n"
        "  --techniques a,b,c        default: all\n"
        "  --resolutions 600,1080    image heights, 4:3\n"
        "  --map-sizes 1024,2048     shadow map sides, for methods that have one\n"
        "  --light-sizes 0.2,1       side of the square light over the scene's radius\n"
        "  --lights 1,4              lights in the scene, 1 to 8\n"
        "  --triangles 70000,3000000 of hairball, foliage and columns\n"
        "  --moving-light            rebuild shadow inputs for every image\n"
        "  --runs N --warm-up N      default 9 and 3\n"
        "  --seconds S               a point takes about so long at most; one run at least\n"
        "  --limit S                 of everything: what has not been measured then is left out\n"
        "  --device auto|gpu|surfaceless|osmesa\n"
        "  --json FILE               the same figures as JSON");
}

static uint32_t parse_list(const char *text, double *values)
{
    uint32_t count = 0;
    while (*text && count < MAX_VALUES) {
        char *end;
        values[count] = strtod(text, &end);
        if (end == text || !(values[count] >= 0))
            return 0;
        count++;
        text = *end == ',' ? end + 1 : end;
    }
    return count;
}

static void fail(const struct pen_error *error)
{
    fprintf(stderr, "penumbra-bench: %s\n", error->message);
    exit(1);
}

static int open_scene(const char *name, uint32_t triangles)
{
    struct pen_error error = {0};
    for (uint32_t i = 0; pen_generated_names[i]; i++) {
        if (strcmp(pen_generated_names[i], name))
            continue;
        struct pen_generated_options options = {.kind = i, .triangles = triangles};
        void *data;
        size_t bytes;
        if (!pen_generate_blob(&options, &data, &bytes, &error))
            fail(&error);
        int fd = memfd_create("scene", MFD_CLOEXEC);
        for (size_t done = 0; done < bytes;) {
            ssize_t n = write(fd, (char *)data + done, bytes - done);
            if (n <= 0)
                exit(1);
            done += (size_t)n;
        }
        free(data);
        return fd;
    }
    int fd = open(name, O_RDONLY | O_CLOEXEC);
    if (fd < 0) {
        fprintf(stderr, "penumbra-bench: no scene %s\n", name);
        exit(1);
    }
    return fd;
}

static int compare_floats(const void *a, const void *b)
{
    float x = *(const float *)a, y = *(const float *)b;
    return x < y ? -1 : x > y;
}

static float quantile(float *values, uint32_t count, float q)
{
    qsort(values, count, sizeof *values, compare_floats);
    return values[(uint32_t)(q * (float)(count - 1) + 0.5f)];
}

/* `count` copies of the resolved light around the scene, each `size` times the radius wide. */
static void set_lights(struct pen_request *request, const struct pen_result *first, uint32_t count,
    float size, float scale)
{
    request->lights_given = 1;
    request->light_count = count;
    for (uint32_t i = 0; i < count; i++) {
        struct pen_light *light = &request->lights[i];
        *light = first->completed.lights[0];
        light->power_w /= (float)count;
        float turn = (float)i * 0.7f;
        light->position[0] += turn * light->width;
        if (light->type == PEN_LIGHT_RECT && size > 0)
            light->width = light->height = size * scale;
    }
}

static bool measure(struct pen_renderer *renderer, struct pen_request *request,
    const struct options *o, struct sample *sample, struct pen_error *error)
{
    static struct pen_result result;
    static float totals[MAX_RUNS], passes[PEN_MAX_PASSES][MAX_RUNS];
    struct pen_frame frame;
    uint32_t warm_up = o->warm_up, n = 0;
    double began = seconds_now();
    for (uint32_t i = 0; i < warm_up + o->runs; i++) {
        double spent = seconds_now() - began;
        if (o->seconds > 0 && i > 0 && i < warm_up && spent > o->seconds / 4)
            warm_up = i;
        if (o->seconds > 0 && n > 0 && spent > o->seconds)
            break;
        if (o->moving_light)
            for (uint32_t l = 0; l < request->light_count; l++)
                request->lights[l].position[1] += 1e-4f;
        pen_renderer_drop_views(renderer); /* as if the camera moved */
        if (!pen_renderer_render(renderer, request, &frame, &result, error))
            return false;
        pen_frame_finish(&frame);
        if (i < warm_up)
            continue;
        totals[n] = 0;
        for (uint32_t p = 0; p < result.pass_count; p++) {
            passes[p][n] = result.passes[p].ms;
            totals[n] += result.passes[p].ms;
        }
        n++;
    }
    sample->runs = n;
    sample->pass_count = result.pass_count;
    for (uint32_t p = 0; p < result.pass_count; p++) {
        sample->passes[p] = result.passes[p];
        sample->passes[p].ms = quantile(passes[p], n, 0.5f);
    }
    sample->median_ms = quantile(totals, n, 0.5f);
    sample->low_ms = quantile(totals, n, 0.25f);
    sample->high_ms = quantile(totals, n, 0.75f);
    sample->at[AXIS_TRIANGLES] = result.triangles_drawn;
    return true;
}

static void print_sample(const struct sample *s)
{
    printf("%-18s %4ux%-4.0f map %-5.0f light %-5.2f lights %-2.0f tris %-8.0f ", s->method,
        s->width, s->at[AXIS_HEIGHT], s->at[AXIS_MAP], s->at[AXIS_LIGHT_SIZE], s->at[AXIS_LIGHTS],
        s->at[AXIS_TRIANGLES]);
    if (s->error[0])
        printf("%s\n", s->error);
    else
        printf("%9.3f ms (%.3f to %.3f, %u runs)\n", (double)s->median_ms, (double)s->low_ms,
            (double)s->high_ms, s->runs);
    for (uint32_t i = 0; i < s->pass_count; i++)
        printf("    %-10s %-22s x%-4u %9.3f ms\n", pen_stage_names[s->passes[i].stage],
            s->passes[i].name, s->passes[i].count, (double)s->passes[i].ms);
    fflush(stdout);
}

/* Names and messages are ours and hold neither quotes nor backslashes, but who knows. */
static void write_text(FILE *file, const char *text)
{
    fputc('"', file);
    for (; *text; text++)
        fputc(*text == '"' || *text == '\\' || (unsigned char)*text < ' ' ? ' ' : *text, file);
    fputc('"', file);
}

static void write_json(FILE *file, const struct sample *s, bool first)
{
    fprintf(
        file, "%s\n  {\"method\": \"%s\", \"width\": %u", first ? "" : ",", s->method, s->width);
    for (uint32_t a = 0; a < AXES; a++)
        fprintf(file, ", \"%s\": %g", bench_axis_names[a], s->at[a]);
    if (s->error[0]) {
        fputs(", \"error\": ", file);
        write_text(file, s->error);
        fputc('}', file);
        return;
    }
    fprintf(file,
        ", \"runs\": %u, \"median_ms\": %.4f, \"low_ms\": %.4f, \"high_ms\": %.4f, "
        "\"passes\": [",
        s->runs, (double)s->median_ms, (double)s->low_ms, (double)s->high_ms);
    for (uint32_t i = 0; i < s->pass_count; i++)
        fprintf(file, "%s{\"stage\": \"%s\", \"name\": \"%s\", \"count\": %u, \"ms\": %.4f}",
            i ? ", " : "", pen_stage_names[s->passes[i].stage], s->passes[i].name,
            s->passes[i].count, (double)s->passes[i].ms);
    fputs("]}", file);
}

static bool is_wanted(const char *list, const char *name)
{
    size_t length = strlen(name);
    for (const char *at = list; at && (at = strstr(at, name)); at += length)
        if ((at == list || at[-1] == ',') && (!at[length] || at[length] == ','))
            return true;
    return !list;
}

/* What all points of a run share. */
struct run {
    struct pen_renderer *renderer;
    const struct options *options;
    FILE *json;
    bool first; /* nothing has been written yet */
    uint8_t scene[PEN_ID_BYTES];
};

/* The request of one point: lights come from a first, cheap image, which resolves them. */
static bool prepare(const struct run *run, const struct pen_technique_info *info,
    const double at[AXES], struct sample *sample, struct pen_request *request,
    struct pen_error *error)
{
    static struct pen_result probe;
    struct pen_frame frame;
    const struct pen_param *map_row = pen_param_find(info->params, "map_size");
    pen_request_default(request, pen_renderer_catalogue());
    memcpy(request->scene, run->scene, sizeof run->scene);
    memset(request->technique, 0, sizeof request->technique);
    strncpy(request->technique, info->name, sizeof request->technique - 1);
    memset(request->technique_params, 0, sizeof request->technique_params);
    pen_params_default(info->params, request->technique_params);
    if (map_row && at[AXIS_MAP] > 0 &&
        !pen_param_store(map_row, request->technique_params, &at[AXIS_MAP], "", error))
        return false;
    sample->at[AXIS_MAP] = map_row ? pen_param_load(map_row, request->technique_params, 0) : 0;
    request->height = (uint32_t)at[AXIS_HEIGHT];
    request->width = sample->width = request->height * 4 / 3;
    request->output.layer = PEN_LAYER_DEPTH;
    if (!pen_renderer_render(run->renderer, request, &frame, &probe, error))
        return false;
    pen_frame_finish(&frame);
    request->output.layer = PEN_LAYER_BEAUTY;
    /* The automatic light is 0.6 radii wide. */
    set_lights(request, &probe, (uint32_t)at[AXIS_LIGHTS], (float)at[AXIS_LIGHT_SIZE],
        probe.completed.lights[0].width / 0.6f);
    return true;
}

static void run_point(
    struct run *run, const struct pen_technique_info *info, uint32_t axis, uint32_t value)
{
    static struct pen_request request;
    struct pen_error error = {0};
    struct sample sample = {.method = info->name};
    if (time_is_up)
        return;
    for (uint32_t a = 0; a < AXES; a++)
        sample.at[a] = run->options->values[a][a == axis ? value : 0];
    if (!prepare(run, info, sample.at, &sample, &request, &error) ||
        !measure(run->renderer, &request, run->options, &sample, &error))
        snprintf(sample.error, sizeof sample.error, "%s", error.message);
    print_sample(&sample);
    if (run->json)
        write_json(run->json, &sample, run->first);
    run->first = false;
    if (sample.error[0] || point_count == MAX_POINTS)
        return;
    struct growth_point *point = &points[point_count++];
    *point =
        (struct growth_point){.method = info->name, .axis = axis, .ms = (double)sample.median_ms};
    memcpy(point->at, sample.at, sizeof point->at);
}

/* Every method that has the axis, at one value of it. */
static void run_methods(struct run *run, uint32_t axis, uint32_t value, double began)
{
    const struct options *o = run->options;
    const struct pen_catalogue *catalogue = pen_renderer_catalogue();
    for (uint32_t m = 0; m < catalogue->count; m++) {
        const struct pen_technique_info *info = catalogue->items[m];
        bool has_axis = axis != AXIS_MAP || pen_param_find(info->params, "map_size");
        time_is_up = o->limit > 0 && seconds_now() - began > o->limit;
        if (has_axis && is_wanted(o->techniques, info->name))
            run_point(run, info, axis, value);
    }
}

/* One scene of one size; the first is the base, from which every other axis leaves. */
static void run_scene(struct run *run, uint32_t number, double began)
{
    const struct options *o = run->options;
    struct pen_error error = {0};
    run->scene[0] = 1;
    memcpy(run->scene + 1, &number, sizeof number);
    int fd = open_scene(o->scene, (uint32_t)o->values[AXIS_TRIANGLES][number]);
    if (!pen_renderer_load_scene(run->renderer, run->scene, fd, &error))
        fail(&error);
    close(fd);
    run_methods(run, number ? AXIS_TRIANGLES : AXES, number, began);
    for (uint32_t axis = 0; axis < AXIS_TRIANGLES && !number; axis++)
        for (uint32_t v = 1; v < o->counts[axis]; v++)
            run_methods(run, axis, v, began);
    pen_renderer_drop_scene(run->renderer, run->scene);
}

/* False: a usage error. */
static bool parse(int argc, char **argv, struct options *o)
{
    static const struct option long_options[] = {{"scene", 1, 0, 's'}, {"techniques", 1, 0, 't'},
        {"resolutions", 1, 0, AXIS_HEIGHT}, {"map-sizes", 1, 0, AXIS_MAP},
        {"light-sizes", 1, 0, AXIS_LIGHT_SIZE}, {"lights", 1, 0, AXIS_LIGHTS},
        {"triangles", 1, 0, AXIS_TRIANGLES}, {"moving-light", 0, 0, 'M'}, {"runs", 1, 0, 'R'},
        {"warm-up", 1, 0, 'w'}, {"seconds", 1, 0, 'S'}, {"limit", 1, 0, 'T'}, {"device", 1, 0, 'd'},
        {"json", 1, 0, 'j'}, {"help", 0, 0, 'h'}, {0}};
    for (int c; (c = getopt_long(argc, argv, "", long_options, NULL)) != -1;) {
        int device = 0;
        if (c >= 0 && c < AXES)
            o->counts[c] = parse_list(optarg, o->values[c]);
        else if (c == 's')
            o->scene = optarg;
        else if (c == 't')
            o->techniques = optarg;
        else if (c == 'M')
            o->moving_light = true;
        else if (c == 'R')
            o->runs = (uint32_t)atoi(optarg);
        else if (c == 'w')
            o->warm_up = (uint32_t)atoi(optarg);
        else if (c == 'S')
            o->seconds = atof(optarg);
        else if (c == 'T')
            o->limit = atof(optarg);
        else if (c == 'j')
            o->json = optarg;
        else if (c == 'd' && (device = pen_choice_index(pen_device_choice_names, optarg)) >= 0)
            o->device = (uint32_t)device;
        else if (c == 'h') {
            usage();
            exit(0);
        } else
            return false;
    }
    bool ok = o->runs && o->runs <= MAX_RUNS && optind == argc;
    for (uint32_t a = 0; a < AXES; a++)
        ok = ok && o->counts[a];
    for (uint32_t i = 0; ok && i < o->counts[AXIS_LIGHTS]; i++)
        ok = o->values[AXIS_LIGHTS][i] >= 1 && o->values[AXIS_LIGHTS][i] <= PEN_MAX_LIGHTS;
    return ok;
}

int main(int argc, char **argv)
{
    struct options o = {.scene = "demo",
        .runs = 9,
        .warm_up = 3,
        .values = {[AXIS_HEIGHT] = {600}, [AXIS_LIGHT_SIZE] = {0.6}, [AXIS_LIGHTS] = {1}},
        .counts = {1, 1, 1, 1, 1}};
    if (!parse(argc, argv, &o)) {
        usage();
        return 2;
    }
    double began = seconds_now();
    struct pen_error error = {0};
    struct pen_renderer_config config = {
        .device = {.choice = o.device}, .gpu_memory_bytes = 4ull << 30};
    struct run run = {
        .renderer = pen_renderer_create(&config, &error), .options = &o, .first = true};
    if (!run.renderer)
        fail(&error);
    const struct pen_device_info *device = pen_renderer_device(run.renderer);
    printf(
        "%s, %s, %s\n", device->renderer, device->version, device->software ? "software" : "GPU");
    if (o.json && !(run.json = fopen(o.json, "w"))) {
        fprintf(stderr, "penumbra-bench: cannot write %s\n", o.json);
        return 1;
    }
    if (run.json) {
        fputs("{\"device\": ", run.json);
        write_text(run.json, device->renderer);
        fprintf(run.json, ", \"software\": %s, \"scene\": ", device->software ? "true" : "false");
        write_text(run.json, o.scene);
        fprintf(
            run.json, ", \"moving_light\": %s, \"samples\": [", o.moving_light ? "true" : "false");
    }
    for (uint32_t i = 0; i < o.counts[AXIS_TRIANGLES] && !time_is_up; i++)
        run_scene(&run, i, began);
    growth_print(stdout, points, point_count);
    if (time_is_up)
        puts("\nThe time was up: some points were left out.");
    if (run.json) {
        fputs("\n], \"growth\": ", run.json);
        growth_json(run.json, points, point_count);
        fprintf(run.json, ", \"complete\": %s}\n", time_is_up ? "false" : "true");
        fclose(run.json);
    }
    pen_renderer_destroy(run.renderer);
    return 0;
}
