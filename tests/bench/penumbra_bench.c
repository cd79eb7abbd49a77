/* penumbra-bench: what every method and every pass costs, without a daemon. Needs the renderer, a C
 * compiler and EGL only. See usage(). */
#include "renderer/generate/generate.h"
#include "renderer/renderer.h"
#include <fcntl.h>
#include <getopt.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

#define MAX_RUNS 256
#define MAX_VALUES 16

struct options {
    const char *scene, *techniques, *json;
    uint32_t runs, warm_up, device, lights;
    bool moving_light; /* shadow inputs are rebuilt for every image */
    /* Axes; each is swept alone, the others stay at their first value. */
    uint32_t resolutions[MAX_VALUES], maps[MAX_VALUES], triangles[MAX_VALUES];
    float light_sizes[MAX_VALUES];
    uint32_t resolution_count, map_count, triangle_count, light_size_count;
};

struct sample {
    const char *method;
    uint32_t width, height, map_size, triangles, lights;
    float light_size;
    float median_ms, low_ms, high_ms;            /* of the whole image; quartiles */
    struct pen_pass_time passes[PEN_MAX_PASSES]; /* ms: medians */
    uint32_t pass_count;
};

static void usage(void)
{
    puts("penumbra-bench [options]\n"
         "  --scene NAME|FILE.pscene  demo, hairball, foliage, columns, ... or an imported scene\n"
         "  --techniques a,b,c        default: all\n"
         "  --resolutions 600,1080    image heights, 4:3\n"
         "  --map-sizes 1024,2048     shadow map sides, for methods that have one\n"
         "  --light-sizes 0.2,1       side of the square light over the scene's radius\n"
         "  --triangles 70000,3000000 for generated scenes\n"
         "  --lights N                lights in the scene (1 to 8)\n"
         "  --moving-light            rebuild shadow inputs for every image\n"
         "  --runs N --warm-up N      default 9 and 3\n"
         "  --device auto|gpu|surfaceless|osmesa\n"
         "  --json FILE               the same figures as JSON");
}

static uint32_t parse_list(const char *text, uint32_t *integers, float *reals)
{
    uint32_t count = 0;
    while (*text && count < MAX_VALUES) {
        char *end;
        double value = strtod(text, &end);
        if (end == text)
            break;
        if (integers)
            integers[count] = (uint32_t)value;
        else
            reals[count] = (float)value;
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

static void measure(struct pen_renderer *renderer, struct pen_request *request,
    const struct options *o, struct sample *sample)
{
    static struct pen_result result;
    static float totals[MAX_RUNS], passes[PEN_MAX_PASSES][MAX_RUNS];
    struct pen_error error = {0};
    struct pen_frame frame;
    for (uint32_t i = 0; i < o->warm_up + o->runs; i++) {
        if (o->moving_light)
            request->lights[0].position[1] += 1e-4f;
        if (!pen_renderer_render(renderer, request, &frame, &result, &error))
            fail(&error);
        pen_frame_finish(&frame);
        if (i < o->warm_up)
            continue;
        float total = 0;
        for (uint32_t p = 0; p < result.pass_count; p++) {
            passes[p][i - o->warm_up] = result.passes[p].ms;
            total += result.passes[p].ms;
        }
        totals[i - o->warm_up] = total;
    }
    sample->pass_count = result.pass_count;
    for (uint32_t p = 0; p < result.pass_count; p++) {
        sample->passes[p] = result.passes[p];
        sample->passes[p].ms = quantile(passes[p], o->runs, 0.5f);
    }
    sample->median_ms = quantile(totals, o->runs, 0.5f);
    sample->low_ms = quantile(totals, o->runs, 0.25f);
    sample->high_ms = quantile(totals, o->runs, 0.75f);
    sample->triangles = result.triangles_drawn;
}

static void print_sample(const struct sample *s)
{
    printf("%-18s %4ux%-4u map %-5u light %-5.2f tris %-8u lights %u  %9.3f ms (%.3f to %.3f)\n",
        s->method, s->width, s->height, s->map_size, (double)s->light_size, s->triangles, s->lights,
        (double)s->median_ms, (double)s->low_ms, (double)s->high_ms);
    for (uint32_t i = 0; i < s->pass_count; i++)
        printf("    %-10s %-22s x%-4u %9.3f ms\n", pen_stage_names[s->passes[i].stage],
            s->passes[i].name, s->passes[i].count, (double)s->passes[i].ms);
    fflush(stdout);
}

static void write_json(FILE *file, const struct sample *s, bool first)
{
    fprintf(file,
        "%s\n  {\"method\": \"%s\", \"width\": %u, \"height\": %u, \"map_size\": %u, "
        "\"light_size\": %g, \"triangles\": %u, \"lights\": %u, \"median_ms\": %.4f, "
        "\"low_ms\": %.4f, \"high_ms\": %.4f, \"passes\": [",
        first ? "" : ",", s->method, s->width, s->height, s->map_size, (double)s->light_size,
        s->triangles, s->lights, (double)s->median_ms, (double)s->low_ms, (double)s->high_ms);
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

/* One scene of one size: every method over every axis. */
static void run_scene(struct pen_renderer *renderer, const struct options *o, uint32_t triangles,
    FILE *json, bool *first)
{
    const struct pen_catalogue *catalogue = pen_renderer_catalogue();
    struct pen_error error = {0};
    struct pen_request request;
    static struct pen_result probe;
    struct pen_frame frame;
    uint8_t id[PEN_ID_BYTES] = {1};
    memcpy(id + 1, &triangles, sizeof triangles);
    int fd = open_scene(o->scene, triangles);
    if (!pen_renderer_load_scene(renderer, id, fd, &error))
        fail(&error);
    close(fd);
    for (uint32_t m = 0; m < catalogue->count; m++) {
        const struct pen_technique_info *info = catalogue->items[m];
        if (!is_wanted(o->techniques, info->name))
            continue;
        const struct pen_param *map_row = pen_param_find(info->params, "map_size");
        uint32_t maps = map_row ? o->map_count : 1;
        uint32_t steps = o->resolution_count + maps + o->light_size_count - 2;
        for (uint32_t step = 0; step < steps; step++) {
            /* Step 0 is the base; then each axis leaves its first value on its own. */
            uint32_t r = step < o->resolution_count ? step : 0;
            uint32_t k = step >= o->resolution_count && step < o->resolution_count + maps - 1
                             ? step - o->resolution_count + 1
                             : 0;
            uint32_t l = step >= o->resolution_count + maps - 1
                             ? step - (o->resolution_count + maps - 1) + 1
                             : 0;
            pen_request_default(&request, catalogue);
            memcpy(request.scene, id, sizeof id);
            memset(request.technique, 0, sizeof request.technique);
            strncpy(request.technique, info->name, sizeof request.technique - 1);
            memset(request.technique_params, 0, sizeof request.technique_params);
            pen_params_default(info->params, request.technique_params);
            request.height = o->resolutions[r];
            request.width = request.height * 4 / 3;
            request.output.layer = PEN_LAYER_DEPTH;
            if (!pen_renderer_render(renderer, &request, &frame, &probe, &error))
                fail(&error);
            pen_frame_finish(&frame);
            request.output.layer = PEN_LAYER_BEAUTY;
            /* The automatic light is 0.6 radii wide. */
            set_lights(&request, &probe, o->lights, o->light_sizes[l],
                probe.completed.lights[0].width / 0.6f);
            struct sample sample = {.method = info->name,
                .width = request.width,
                .height = request.height,
                .light_size = o->light_sizes[l],
                .lights = o->lights};
            if (map_row) {
                double value = o->maps[k];
                if (value > 0 &&
                    !pen_param_store(map_row, request.technique_params, &value, "", &error))
                    fail(&error);
                sample.map_size = (uint32_t)pen_param_load(map_row, request.technique_params, 0);
            }
            measure(renderer, &request, o, &sample);
            print_sample(&sample);
            if (json)
                write_json(json, &sample, *first);
            *first = false;
        }
    }
    pen_renderer_drop_scene(renderer, id);
}

int main(int argc, char **argv)
{
    static const struct option long_options[] = {{"scene", 1, 0, 's'}, {"techniques", 1, 0, 't'},
        {"resolutions", 1, 0, 'r'}, {"map-sizes", 1, 0, 'm'}, {"light-sizes", 1, 0, 'l'},
        {"triangles", 1, 0, 'n'}, {"lights", 1, 0, 'L'}, {"moving-light", 0, 0, 'M'},
        {"runs", 1, 0, 'R'}, {"warm-up", 1, 0, 'w'}, {"device", 1, 0, 'd'}, {"json", 1, 0, 'j'},
        {"help", 0, 0, 'h'}, {0}};
    struct options o = {.scene = "demo",
        .runs = 9,
        .warm_up = 3,
        .lights = 1,
        .resolutions = {600},
        .resolution_count = 1,
        .map_count = 1,
        .triangle_count = 1,
        .light_sizes = {0.6f},
        .light_size_count = 1};
    for (int c; (c = getopt_long(argc, argv, "", long_options, NULL)) != -1;) {
        int device;
        switch (c) {
        case 's':
            o.scene = optarg;
            break;
        case 't':
            o.techniques = optarg;
            break;
        case 'r':
            o.resolution_count = parse_list(optarg, o.resolutions, NULL);
            break;
        case 'm':
            o.map_count = parse_list(optarg, o.maps, NULL);
            break;
        case 'l':
            o.light_size_count = parse_list(optarg, NULL, o.light_sizes);
            break;
        case 'n':
            o.triangle_count = parse_list(optarg, o.triangles, NULL);
            break;
        case 'L':
            o.lights = (uint32_t)atoi(optarg);
            break;
        case 'M':
            o.moving_light = true;
            break;
        case 'R':
            o.runs = (uint32_t)atoi(optarg);
            break;
        case 'w':
            o.warm_up = (uint32_t)atoi(optarg);
            break;
        case 'j':
            o.json = optarg;
            break;
        case 'd':
            if ((device = pen_choice_index(pen_device_choice_names, optarg)) < 0) {
                usage();
                return 2;
            }
            o.device = (uint32_t)device;
            break;
        default:
            usage();
            return c == 'h' ? 0 : 2;
        }
    }
    if (!o.runs || o.runs > MAX_RUNS || !o.lights || o.lights > PEN_MAX_LIGHTS ||
        !o.resolution_count || !o.map_count || !o.light_size_count || !o.triangle_count) {
        usage();
        return 2;
    }
    struct pen_error error = {0};
    struct pen_renderer_config config = {.device = o.device, .gpu_memory_bytes = 4ull << 30};
    struct pen_renderer *renderer = pen_renderer_create(&config, &error);
    if (!renderer)
        fail(&error);
    const struct pen_device_info *device = pen_renderer_device(renderer);
    printf(
        "%s, %s, %s\n", device->renderer, device->version, device->software ? "software" : "GPU");
    FILE *json = o.json ? fopen(o.json, "w") : NULL;
    bool first = true;
    if (json)
        fprintf(json, "{\"device\": \"%s\", \"software\": %s, \"scene\": \"%s\", \"samples\": [",
            device->renderer, device->software ? "true" : "false", o.scene);
    for (uint32_t i = 0; i < o.triangle_count; i++)
        run_scene(renderer, &o, o.triangles[i], json, &first);
    if (json) {
        fputs("\n]}\n", json);
        fclose(json);
    }
    pen_renderer_destroy(renderer);
    return 0;
}
