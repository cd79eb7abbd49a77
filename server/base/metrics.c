#include "server/base/metrics.h"
#include "protocol/memory.h"
#include "server/base/clock.h"
#include <pthread.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define MAX_ROUTES 40
#define MAX_STATUSES 24
#define MAX_METHODS 64
#define BUCKETS 12
#define WINDOW 512 /* renders that the rolling numbers look back on */

static const double bucket_ms[BUCKETS] = {1, 2.5, 5, 10, 25, 50, 100, 250, 500, 1000, 5000, 30000};

struct histogram {
    uint64_t counts[BUCKETS + 1];
    double sum_ms;
};

struct route_numbers {
    const char *route;
    struct histogram times;
    uint16_t statuses[MAX_STATUSES];
    uint64_t counts[MAX_STATUSES];
};

struct method_numbers {
    uint64_t renders;
    double stage_ms[PEN_STAGES];
};

struct sample {
    uint64_t at_ns;
    uint16_t method;
    float stage_ms[PEN_STAGES];
    float total_ms;
};

struct metrics {
    const struct pen_catalogue *catalogue; /* constant */
    pthread_mutex_t lock;                  /* guards everything below */
    struct route_numbers routes[MAX_ROUTES];
    struct method_numbers methods[MAX_METHODS];
    struct histogram overhead;
    struct sample window[WINDOW];
    uint64_t samples;
    uint64_t shadow_reused, scene_resident, renders;
};

struct metrics *metrics_create(const struct pen_catalogue *catalogue)
{
    struct metrics *m = pen_alloc_zero(1, sizeof *m);
    m->catalogue = catalogue;
    pthread_mutex_init(&m->lock, NULL);
    return m;
}

void metrics_destroy(struct metrics *m)
{
    if (!m)
        return;
    pthread_mutex_destroy(&m->lock);
    free(m);
}

static void add_time(struct histogram *h, double ms)
{
    int b = 0;
    while (b < BUCKETS && ms > bucket_ms[b])
        b++;
    h->counts[b]++;
    h->sum_ms += ms;
}

void metrics_request(struct metrics *m, const char *route, uint32_t status, double ms)
{
    pthread_mutex_lock(&m->lock);
    struct route_numbers *r = m->routes;
    while (r < m->routes + MAX_ROUTES - 1 && r->route && strcmp(r->route, route))
        r++;
    r->route = route;
    add_time(&r->times, ms);
    int s = 0;
    while (s < MAX_STATUSES - 1 && r->statuses[s] && r->statuses[s] != status)
        s++;
    r->statuses[s] = (uint16_t)status;
    r->counts[s]++;
    pthread_mutex_unlock(&m->lock);
}

static uint32_t method_index(const struct metrics *m, const char *name)
{
    for (uint32_t i = 0; i < m->catalogue->count && i < MAX_METHODS; i++)
        if (!strcmp(m->catalogue->items[i]->name, name))
            return i;
    return 0;
}

void metrics_render(struct metrics *m, const struct pen_result *result)
{
    uint32_t method = method_index(m, result->completed.technique);
    pthread_mutex_lock(&m->lock);
    struct sample *sample = &m->window[m->samples++ % WINDOW];
    sample->at_ns = clock_now_ns();
    sample->method = (uint16_t)method;
    sample->total_ms = 0;
    m->methods[method].renders++;
    for (int s = 0; s < PEN_STAGES; s++) {
        m->methods[method].stage_ms[s] += result->stage_ms[s];
        sample->stage_ms[s] = result->stage_ms[s];
        sample->total_ms += result->stage_ms[s];
    }
    m->renders++;
    m->shadow_reused += result->shadow_inputs_reused != 0;
    m->scene_resident += result->scene_was_resident != 0;
    pthread_mutex_unlock(&m->lock);
}

void metrics_overhead(struct metrics *m, double ms)
{
    pthread_mutex_lock(&m->lock);
    add_time(&m->overhead, ms);
    pthread_mutex_unlock(&m->lock);
}

void metrics_print(struct metrics_text *text, const char *format, ...)
{
    char line[512];
    va_list args;
    va_start(args, format);
    int n = vsnprintf(line, sizeof line, format, args);
    va_end(args);
    size_t bytes = n < (int)sizeof line ? (size_t)n : sizeof line - 1;
    text->text = pen_grow(text->text, &text->capacity, text->size + bytes + 1, 1);
    memcpy(text->text + text->size, line, bytes + 1);
    text->size += bytes;
}

void metrics_print_one(
    struct metrics_text *text, const char *name, const char *type, const char *help, double value)
{
    metrics_print(
        text, "# HELP %s %s\n# TYPE %s %s\n%s %.17g\n", name, help, name, type, name, value);
}

/* `labels` is "" or "route=\"/v1\"". */
static void write_histogram(
    struct metrics_text *text, const char *name, const char *labels, const struct histogram *h)
{
    const char *comma = *labels ? "," : "";
    uint64_t count = 0;
    for (int b = 0; b <= BUCKETS; b++) {
        count += h->counts[b];
        if (b < BUCKETS)
            metrics_print(text, "%s_bucket{%s%sle=\"%g\"} %llu\n", name, labels, comma,
                bucket_ms[b] / 1e3, (unsigned long long)count);
        else
            metrics_print(text, "%s_bucket{%s%sle=\"+Inf\"} %llu\n", name, labels, comma,
                (unsigned long long)count);
    }
    const char *open = *labels ? "{" : "", *close = *labels ? "}" : "";
    metrics_print(text, "%s_sum%s%s%s %.9g\n%s_count%s%s%s %llu\n", name, open, labels, close,
        h->sum_ms / 1e3, name, open, labels, close, (unsigned long long)count);
}

void metrics_write(struct metrics *m, struct metrics_text *text)
{
    struct metrics *copy = pen_alloc(1, sizeof *copy);
    pthread_mutex_lock(&m->lock);
    memcpy(copy, m, sizeof *copy);
    pthread_mutex_unlock(&m->lock);

    metrics_print(text, "# HELP penumbra_requests_total Answered requests.\n"
                        "# TYPE penumbra_requests_total counter\n");
    for (int r = 0; r < MAX_ROUTES && copy->routes[r].route; r++)
        for (int s = 0; s < MAX_STATUSES && copy->routes[r].statuses[s]; s++)
            metrics_print(text, "penumbra_requests_total{route=\"%s\",code=\"%u\"} %llu\n",
                copy->routes[r].route, copy->routes[r].statuses[s],
                (unsigned long long)copy->routes[r].counts[s]);
    metrics_print(text,
        "# HELP penumbra_request_seconds From the end of the header to the last byte sent.\n"
        "# TYPE penumbra_request_seconds histogram\n");
    for (int r = 0; r < MAX_ROUTES && copy->routes[r].route; r++) {
        char labels[128];
        snprintf(labels, sizeof labels, "route=\"%s\"", copy->routes[r].route);
        write_histogram(text, "penumbra_request_seconds", labels, &copy->routes[r].times);
    }
    metrics_print(text,
        "# HELP penumbra_render_overhead_seconds HTTP, JSON, queue and transport of "
        "a render: the total minus all stages but the queue's.\n"
        "# TYPE penumbra_render_overhead_seconds histogram\n");
    write_histogram(text, "penumbra_render_overhead_seconds", "", &copy->overhead);
    metrics_print(text, "# HELP penumbra_renders_total Images rendered.\n"
                        "# TYPE penumbra_renders_total counter\n");
    uint32_t methods = copy->catalogue->count < MAX_METHODS ? copy->catalogue->count : MAX_METHODS;
    for (uint32_t i = 0; i < methods; i++)
        metrics_print(text, "penumbra_renders_total{technique=\"%s\"} %llu\n",
            copy->catalogue->items[i]->name, (unsigned long long)copy->methods[i].renders);
    metrics_print(text, "# HELP penumbra_stage_seconds_total Time spent per stage.\n"
                        "# TYPE penumbra_stage_seconds_total counter\n");
    for (uint32_t i = 0; i < methods; i++)
        for (int s = 0; copy->methods[i].renders && s < PEN_STAGES; s++)
            metrics_print(text,
                "penumbra_stage_seconds_total{technique=\"%s\",stage=\"%s\"} %.9g\n",
                copy->catalogue->items[i]->name, pen_stage_names[s],
                copy->methods[i].stage_ms[s] / 1e3);
    metrics_print_one(text, "penumbra_shadow_inputs_reused_total", "counter",
        "Renders that built no shadow input.", (double)copy->shadow_reused);
    metrics_print_one(text, "penumbra_scene_resident_total", "counter",
        "Renders whose scene was in GPU memory.", (double)copy->scene_resident);
    free(copy);
}

static int by_value(const void *a, const void *b)
{
    float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

static void write_spread(struct pen_json *json, const char *key, float *values, uint32_t count)
{
    double sum = 0;
    for (uint32_t i = 0; i < count; i++)
        sum += values[i];
    qsort(values, count, sizeof *values, by_value);
    pen_json_object(json, key);
    pen_json_float(json, "mean_ms", (float)(sum / count));
    pen_json_float(json, "p50_ms", values[count / 2]);
    pen_json_float(json, "p95_ms", values[(uint32_t)(0.95 * (count - 1) + 0.5)]);
    pen_json_float(json, "max_ms", values[count - 1]);
    pen_json_end(json);
}

void metrics_write_recent(struct metrics *m, uint64_t ms, struct pen_json *json)
{
    float values[WINDOW];
    uint32_t count = 0;
    pthread_mutex_lock(&m->lock);
    uint64_t now = clock_now_ns();
    for (uint32_t i = 0; i < WINDOW && i < m->samples; i++)
        if (now - m->window[i].at_ns <= ms * CLOCK_MS)
            values[count++] = m->window[i].total_ms;
    pthread_mutex_unlock(&m->lock);
    pen_json_object(json, "recent");
    pen_json_uint(json, "renders", count);
    if (count)
        write_spread(json, "total", values, count);
    pen_json_end(json);
}

char *metrics_stats_json(struct metrics *m)
{
    struct sample *window = pen_alloc(1, sizeof m->window);
    float *values = pen_alloc(WINDOW, sizeof *values);
    pthread_mutex_lock(&m->lock);
    memcpy(window, m->window, sizeof m->window);
    uint32_t count = m->samples < WINDOW ? (uint32_t)m->samples : WINDOW;
    uint64_t renders = m->renders;
    pthread_mutex_unlock(&m->lock);

    struct pen_json json = {0};
    pen_json_object(&json, NULL);
    pen_json_uint(&json, "renders", renders);
    pen_json_uint(&json, "window", count);
    pen_json_array(&json, "techniques");
    for (uint32_t t = 0; t < m->catalogue->count && t < MAX_METHODS; t++) {
        uint32_t n = 0;
        for (uint32_t i = 0; i < count; i++)
            if (window[i].method == t)
                values[n++] = window[i].total_ms;
        if (!n)
            continue;
        pen_json_object(&json, NULL);
        pen_json_string(&json, "name", m->catalogue->items[t]->name);
        pen_json_uint(&json, "renders", n);
        write_spread(&json, "total", values, n);
        pen_json_object(&json, "stages");
        for (int s = 0; s < PEN_STAGES; s++) {
            n = 0;
            for (uint32_t i = 0; i < count; i++)
                if (window[i].method == t)
                    values[n++] = window[i].stage_ms[s];
            write_spread(&json, pen_stage_names[s], values, n);
        }
        pen_json_end(&json);
        pen_json_end(&json);
    }
    pen_json_end(&json);
    pen_json_end(&json);
    free(window);
    free(values);
    return pen_json_finish(&json, NULL);
}
