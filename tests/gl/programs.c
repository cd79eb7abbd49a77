/* The programs that a renderer keeps: what makes a new one, what leaves, and that neither changes a
 * picture. Arguments: "taps", "bound", "warm", "called" or "rows [METHOD]",
 * a part of it. */
#include "renderer/technique.h"
#include "tests/gl/fixture.h"
#include "tests/unit/check.h"
#include <sys/mman.h>
#include <unistd.h>

static struct pen_renderer *make(uint32_t programs)
{
    struct pen_error error = {0};
    struct pen_renderer_config config = {.device = {.debug = true}, .programs = programs};
    return pen_renderer_create(&config, &error);
}

static void small_request(struct pen_request *request, const uint8_t *id, const char *technique)
{
    fixture_request(request, id, technique);
    request->width = 64, request->height = 48;
}

static void set(struct pen_request *request, const struct pen_param *row, double value)
{
    CHECK(pen_param_store(row, request->technique_params, &value, "", NULL));
}

static const struct pen_param *row_of(const char *technique, const char *name)
{
    return pen_param_find(pen_catalogue_find(pen_renderer_catalogue(), technique)->params, name);
}

/* 500 renders with 500 tap counts: one program for all of them. */
static void check_taps(void)
{
    enum { RENDERS = 500, SEARCHES = 20 };
    struct pen_renderer *r = make(0);
    uint8_t id[PEN_ID_BYTES];
    struct pen_request request;
    struct pen_result result;
    fixture_scene(r, PEN_GENERATED_DEMO, 0, 0, id);
    small_request(&request, id, "pcss");
    uint64_t first = fixture_render(r, &request, &result), others = 0;
    uint32_t compiled = result.programs.compiled;
    double before = fixture_resident_mib();
    CHECK(compiled > 0 && result.programs.kept == compiled);
    for (int i = 0; i < RENDERS; i++) {
        set(&request, row_of("pcss", "search_taps"), 1 + i % SEARCHES);
        set(&request, row_of("pcss", "filter_taps"), 1 + i / SEARCHES * 10);
        others += fixture_render(r, &request, &result) != first;
    }
    double grown = fixture_resident_mib() - before;
    fprintf(stderr, "%d tap counts: %u compiled, %u since the first; %.1f MiB more resident\n",
        RENDERS, result.programs.compiled, result.programs.compiled - compiled, grown);
    CHECK(result.programs.compiled == compiled);
    CHECK(result.programs.evicted == 0);
    CHECK(grown < 30);
    CHECK(others > RENDERS * 9 / 10); /* the counts did reach the shader */
    small_request(&request, id, "pcss");
    CHECK(fixture_render(r, &request, &result) == first);
    pen_renderer_destroy(r);
}

/* Fewer programs than the methods want: they come and go, and the pictures stay. */
static void check_bound(void)
{
    enum { MOST = 4, ROUNDS = 2, METHODS = 8 };
    static const char *const methods[METHODS] = {
        "none", "hard", "pcf", "pcss", "vsm", "evsm", "msm", "screen-space"};
    struct pen_renderer *all = make(0);
    uint64_t wanted[METHODS];
    uint8_t id[PEN_ID_BYTES];
    struct pen_request request;
    struct pen_result result = {0};
    fixture_scene(all, PEN_GENERATED_DEMO, 0, 0, id);
    for (uint32_t i = 0; i < METHODS; i++) {
        small_request(&request, id, methods[i]);
        wanted[i] = fixture_render(all, &request, &result);
    }
    uint32_t distinct = result.programs.compiled;
    CHECK(result.programs.kept == distinct && distinct > 4 * MOST);
    fprintf(stderr, "%u programs, an estimated %.1f MiB; %.1f MiB resident\n", distinct,
        (double)result.programs.bytes / (1 << 20), fixture_resident_mib());
    pen_renderer_destroy(all);

    struct pen_renderer *few = make(MOST);
    uint32_t most = 0;
    fixture_scene(few, PEN_GENERATED_DEMO, 0, 0, id);
    for (uint32_t i = 0; i < ROUNDS * METHODS; i++) {
        small_request(&request, id, methods[i % METHODS]);
        CHECK(fixture_render(few, &request, &result) == wanted[i % METHODS]);
        /* Those of a frame stay whatever the bound: its repetition compiles nothing. */
        uint32_t compiled = result.programs.compiled;
        CHECK(fixture_render(few, &request, &result) == wanted[i % METHODS]);
        CHECK(result.programs.compiled == compiled);
        CHECK(result.programs.kept == result.programs.compiled - result.programs.evicted);
        most = result.programs.kept > most ? result.programs.kept : most;
    }
    fprintf(stderr, "bound %u: at most %u kept, %u compiled, %u evicted\n", MOST, most,
        result.programs.compiled, result.programs.evicted);
    CHECK(result.programs.compiled > distinct && result.programs.evicted > distinct);
    CHECK(most < distinct / 2); /* more than the bound only for a long list of passes */
    pen_renderer_destroy(few);
}

/* The rows are constant; a test may look at how each would be read otherwise. */
static void specialise(const struct pen_technique_info *info, const uint8_t *how, int all)
{
    uintptr_t page = (uintptr_t)sysconf(_SC_PAGESIZE);
    uintptr_t from = (uintptr_t)info->params.rows & ~(page - 1);
    uintptr_t to = (uintptr_t)(info->params.rows + info->params.count);
    struct pen_param *rows = (struct pen_param *)(uintptr_t)info->params.rows;
    if (mprotect((void *)from, to - from, PROT_READ | PROT_WRITE)) {
        CHECK(!"mprotect");
        return;
    }
    for (uint32_t i = 0; i < info->params.count; i++)
        rows[i].specialise = how ? how[i] : (uint8_t)all;
}

/* All rows as uniforms, and with `constants` also all as constants. */
static void check_either_way(struct pen_renderer *r, const struct pen_technique_info *info,
    const struct pen_request *request, const char *what, bool constants)
{
    uint8_t as_written[64];
    struct pen_result result;
    CHECK(info->params.count <= sizeof as_written);
    for (uint32_t i = 0; i < info->params.count; i++)
        as_written[i] = info->params.rows[i].specialise;
    uint64_t wanted = fixture_render(r, request, &result);
    for (int all = 0; all <= constants; all++) {
        specialise(info, NULL, all);
        uint64_t got = fixture_render(r, request, &result);
        if (got != wanted)
            fprintf(stderr, "%s, %s: another picture with every row %s\n", info->name, what,
                all ? "a constant" : "a uniform");
        CHECK(got == wanted);
    }
    specialise(info, as_written, 0);
}

/* Few light samples: it is the programs that are looked at, and 256 maps of a scene take minutes. */
static void rows_request(
    struct pen_request *request, const uint8_t *id, const struct pen_technique_info *info)
{
    small_request(request, id, info->name);
    const struct pen_param *samples = pen_param_find(info->params, "samples");
    if (samples && samples->def > 8)
        set(request, samples, 8);
}

/* Every row as a constant and as a uniform, those that specialise at each of their choices: the same
 * picture. `only`: a method, or NULL for all. */
static void check_rows(const char *only)
{
    const struct pen_catalogue *catalogue = pen_renderer_catalogue();
    struct pen_renderer *r = make(0);
    uint8_t id[PEN_ID_BYTES];
    fixture_scene(r, PEN_GENERATED_DEMO, 0, 0, id);
    for (uint32_t t = 0; t < catalogue->count; t++) {
        const struct pen_technique_info *info = catalogue->items[t];
        struct pen_request request;
        if (only && strcmp(only, info->name))
            continue;
        rows_request(&request, id, info);
        if (info->params.count)
            check_either_way(r, info, &request, "defaults", true);
        for (uint32_t i = 0; i < info->params.count; i++) {
            const struct pen_param *row = &info->params.rows[i];
            if (!row->specialise)
                continue;
            for (int k = 0; row->choices ? row->choices[k] != NULL : k < 2; k++) {
                rows_request(&request, id, info);
                set(&request, row, k);
                if (k != (int)row->def)
                    check_either_way(r, info, &request, row->name, false);
            }
        }
    }
    pen_renderer_destroy(r);
}

/* After warming up nothing is left to compile for a usual picture of a scene that it did not draw. */
static void check_warm(void)
{
    const struct pen_catalogue *catalogue = pen_renderer_catalogue();
    struct pen_request request;
    struct pen_result result;
    uint8_t id[PEN_ID_BYTES];
    for (int all = 0; all < 2; all++) {
        struct pen_renderer *r = make(0);
        pen_renderer_warm_up(r, all ? PEN_WARM_ALL : PEN_WARM_USUAL);
        uint32_t before = pen_renderer_programs(r).compiled;
        fixture_scene(r, PEN_GENERATED_DEMO, 0, 0, id);
        pen_request_default(&request, catalogue);
        for (uint32_t t = 0; t < (all ? catalogue->count : 1); t++) {
            if (all)
                rows_request(&request, id, catalogue->items[t]);
            memcpy(request.scene, id, sizeof id);
            request.width = 64, request.height = 48;
            fixture_render(r, &request, &result);
            if (result.programs.compiled != before)
                fprintf(stderr, "%s compiles %u more\n", request.technique,
                    result.programs.compiled - before);
            CHECK(result.programs.compiled == before);
            before = result.programs.compiled;
        }
        pen_renderer_destroy(r);
    }
}

static bool calls_later(void *context)
{
    uint32_t *questions = context;
    return !*questions || !--*questions;
}

/* How many programs the usual warm-up compiles when somebody calls at the n-th question. */
static uint32_t warmed_until(uint32_t questions)
{
    struct pen_renderer_config config = {.is_called = calls_later, .call_context = &questions};
    struct pen_error error = {0};
    struct pen_renderer *r = pen_renderer_create(&config, &error);
    CHECK(r != NULL);
    pen_renderer_warm_up(r, PEN_WARM_USUAL);
    uint32_t compiled = pen_renderer_programs(r).compiled;
    pen_renderer_destroy(r);
    return compiled;
}

/* Nobody waits behind it. */
static void check_warm_gives_way(void)
{
    uint32_t none = warmed_until(0), some = warmed_until(4), all = warmed_until(UINT32_MAX);
    printf("warmed up: %u, %u, %u programs\n", none, some, all);
    CHECK(none < some && some < all);
}

int main(int argc, char **argv)
{
    struct pen_renderer *r = make(0);
    if (!r)
        return 77;
    pen_renderer_destroy(r);
    if (argc < 2 || !strcmp(argv[1], "taps"))
        check_taps();
    if (argc < 2 || !strcmp(argv[1], "bound"))
        check_bound();
    if (argc < 2 || !strcmp(argv[1], "warm"))
        check_warm();
    if (argc < 2 || !strcmp(argv[1], "called"))
        check_warm_gives_way();
    if (argc < 2 || !strcmp(argv[1], "rows"))
        check_rows(argc > 2 ? argv[2] : NULL);
    CHECK_DONE();
}
