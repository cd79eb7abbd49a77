/* The policy of "auto", on tables made up for the purpose. */
#include "server/auto/history.h"
#include "server/auto/calibration.h"
#include "tests/unit/check.h"

static const struct pen_param sample_rows[] = {
    {.name = "samples", .type = PEN_PARAM_UINT, .count = 1, .def = 8, .min = 1, .max = 4096}};
static const struct pen_technique_info hard = {.name = "hard", .candidates = PEN_CANDIDATES("")};
static const struct pen_technique_info pcss = {.name = "pcss", .candidates = PEN_CANDIDATES("")};
static const struct pen_technique_info plain = {.name = "plain", .textured = true};
static const struct pen_technique_info multisample = {.name = "multisample",
    .textured = true,
    .struct_size = 4,
    .params = {sample_rows, 1},
    .candidates = PEN_CANDIDATES("samples=64", "samples=256"),
    .candidates_need_gpu = true};
static const struct pen_technique_info raytraced = {.name = "raytraced",
    .textured = true,
    .struct_size = 4,
    .params = {sample_rows, 1},
    .candidates = PEN_CANDIDATES("samples=16")};

static const struct auto_table table = {.pixels = 10000,
    .count = 4,
    .rows = {{"hard", .rmse = 0.10, .fixed_ms = 1, .screen_ms = 1},
        {"pcss", .rmse = 0.03, .fixed_ms = 2, .screen_ms = 4},
        {"bilateral", .rmse = 0.015, .fixed_ms = 60, .screen_ms = 1},
        {"raytraced samples=64 seed=1", .rmse = 0.004, .fixed_ms = 1, .screen_ms = 40}}};

/* What is known of a view and, with `any`, of its kind. */
static bool load(struct scene_store *store, const uint8_t *scene,
    const struct pen_device_info *device, const struct auto_table *wanted, bool any,
    struct auto_table *got)
{
    memset(got, 0, sizeof *got);
    memcpy(got->setup, wanted->setup, PEN_ID_BYTES);
    memcpy(got->cost, wanted->cost, PEN_ID_BYTES);
    return calibration_load(store, scene, device, any, got);
}

static const char *choose(double max_rmse, double budget_ms, uint64_t pixels, bool *met)
{
    struct auto_wish wish = {(float)max_rmse, (float)budget_ms};
    struct auto_pick pick;
    CHECK(auto_choose(&table, &wish, pixels, &pick));
    CHECK(strstr(pick.why, pick.row->key) != NULL);
    CHECK_NEAR(pick.predicted_ms, auto_predict(&table, pick.row, pixels), 1e-9);
    *met = pick.met;
    return pick.row->key;
}

static void check_prediction(void)
{
    const struct auto_row *row = &table.rows[1];
    CHECK_NEAR(auto_predict(&table, row, 10000), 6, 1e-9);
    CHECK_NEAR(auto_predict(&table, row, 40000), 2 + 16, 1e-9);
    /* A hundredth of the pixels saves half of the screen's time, no more. */
    CHECK_NEAR(auto_predict(&table, row, 100), 2 + 0.5 * 4 * 1.01, 1e-9);
}

static void check_error(void)
{
    bool met;
    CHECK_STR(choose(0.2, 0, 10000, &met), "hard");
    CHECK(met);
    CHECK_STR(choose(0.05, 0, 10000, &met), "pcss");
    CHECK(met);
    /* 0.03 itself is too near to 0.031: a quarter must be to spare. */
    CHECK_STR(choose(0.031, 0, 10000, &met), "raytraced samples=64 seed=1");
    CHECK_STR(choose(0.038, 0, 10000, &met), "pcss");
    /* What is cheap depends on the size: fixed costs win on large pictures. */
    CHECK_STR(choose(0.02, 0, 10000, &met), "raytraced samples=64 seed=1");
    CHECK_STR(choose(0.02, 0, 100000, &met), "bilateral");
    CHECK(met);
    /* Neither asked: 0.02. */
    CHECK_STR(choose(0, 0, 100000, &met), "bilateral");
    /* Out of reach: the most accurate, and it says so. */
    CHECK_STR(choose(0.001, 0, 10000, &met), "raytraced samples=64 seed=1");
    CHECK(!met);
}

static void check_budget(void)
{
    bool met;
    CHECK_STR(choose(0, 1000, 10000, &met), "raytraced samples=64 seed=1");
    CHECK(met);
    /* 41 ms are expected: 51 leave too little, 52 a fifth. */
    CHECK_STR(choose(0, 51, 10000, &met), "pcss");
    CHECK_STR(choose(0, 52, 10000, &met), "raytraced samples=64 seed=1");
    CHECK_STR(choose(0, 7, 10000, &met), "hard");
    CHECK(met);
    CHECK_STR(choose(0, 1, 10000, &met), "hard");
    CHECK(!met);
    /* Four times the pixels. */
    CHECK_STR(choose(0, 52, 40000, &met), "pcss");
}

static void check_both(void)
{
    bool met;
    CHECK_STR(choose(0.05, 1000, 10000, &met), "pcss"); /* the cheapest that does, not the best */
    CHECK(met);
    CHECK_STR(choose(0.02, 20, 10000, &met), "pcss"); /* nothing does both: the budget holds */
    CHECK(!met);
    CHECK_STR(choose(0.02, 1, 10000, &met), "hard");
    CHECK(!met);
}

static void observe(struct auto_observed *seen, int times, double ms)
{
    for (int i = 0; i < times; i++)
        auto_observe(seen, 10, ms);
}

static void check_observations(void)
{
    static const struct auto_observed nothing;
    struct auto_observed seen = {0};
    CHECK_NEAR(auto_correction(&seen, &nothing), 1, 0);
    observe(&seen, 4, 5);
    CHECK_NEAR(auto_correction(&seen, &nothing), 1, 0); /* too few to be trusted with good news */
    observe(&seen, 1, 20);
    CHECK_NEAR(auto_correction(&seen, &nothing), 2, 1e-6);
    observe(&seen, 35, 5);
    CHECK_NEAR(auto_correction(&seen, &nothing), 0.5, 1e-6); /* one of forty */
    observe(&seen, 3, 30);
    /* Three of forty are more than one in twenty. */
    CHECK_NEAR(auto_correction(&seen, &nothing), 3, 1e-6);
    observe(&seen, AUTO_OBSERVATIONS, 10);
    CHECK_NEAR(auto_correction(&seen, &nothing), 1, 1e-6); /* the old ones are forgotten */
    auto_observe(&seen, 0, 10);                            /* nothing was expected */
    CHECK(seen.count == 40 + 3 + AUTO_OBSERVATIONS);
}

/* What other rows took speaks for a row of which little is known. */
static void check_shared_observations(void)
{
    static const struct auto_observed nothing;
    struct auto_observed slow = {0}, fast = {0}, few = {0}, own = {0};
    observe(&slow, 20, 15);
    observe(&fast, 20, 5);
    observe(&few, 19, 15);
    CHECK_NEAR(auto_correction(&nothing, &slow), 1.5, 1e-6);
    CHECK_NEAR(auto_correction(&nothing, &fast), 0.75, 1e-6); /* half of the good news */
    CHECK_NEAR(auto_correction(&nothing, &few), 1, 0);
    observe(&own, 7, 12);
    CHECK_NEAR(auto_correction(&own, &slow), 1.5, 1e-6);
    CHECK_NEAR(auto_correction(&own, &fast), 1.2, 1e-6);
    observe(&own, 1, 12); /* eight of its own: the others do not matter */
    CHECK_NEAR(auto_correction(&own, &slow), 1.2, 1e-6);
}

/* The same by way of the history, which tells sizes and kinds of view apart. */
static void check_history(void)
{
    struct auto_history *history = auto_history_create();
    const uint8_t one[PEN_ID_BYTES] = {1}, two[PEN_ID_BYTES] = {2};
    struct auto_expected pcss = {.ms = 10}, hard = pcss, larger = pcss, other = pcss;
    auto_history_name(one, "pcss", 400, 300, &pcss);
    auto_history_name(one, "hard", 400, 300, &hard);
    auto_history_name(one, "pcss", 800, 600, &larger);
    auto_history_name(two, "pcss", 400, 300, &other);
    for (int i = 0; i < 20; i++)
        auto_history_add(history, &pcss, 30);
    CHECK_NEAR(auto_history_factor(history, &pcss), 3, 1e-6);
    CHECK_NEAR(auto_history_factor(history, &hard), 3, 1e-6);
    CHECK_NEAR(auto_history_factor(history, &larger), 1, 0);
    CHECK_NEAR(auto_history_factor(history, &other), 1, 0);
    for (int i = 0; i < 1000; i++) { /* more than are remembered */
        auto_history_name(two, "pcss", 400, 301 + (uint32_t)i, &other);
        auto_history_add(history, &other, 20);
    }
    CHECK_NEAR(auto_history_factor(history, &other), 2, 1e-6);
    CHECK_NEAR(auto_history_factor(history, &pcss), 1, 0);
    auto_history_destroy(history);
}

/* A table of another view leaves more of the budget free, and says so. */
static void check_borrowed(void)
{
    struct auto_table borrowed = table;
    struct auto_wish wish = {0, 60};
    struct auto_pick pick;
    CHECK(auto_choose(&borrowed, &wish, 10000, &pick));
    CHECK_STR(pick.row->key, "raytraced samples=64 seed=1"); /* 41 ms */
    CHECK(!strstr(pick.why, "another view"));
    borrowed.borrowed = true;
    CHECK(auto_choose(&borrowed, &wish, 10000, &pick));
    CHECK_STR(pick.row->key, "pcss");
    CHECK(strstr(pick.why, "another view") != NULL);
}

static void check_empty(void)
{
    struct auto_table nothing = {.pixels = 1};
    struct auto_wish wish = {0.02f, 0};
    struct auto_pick pick;
    CHECK(!auto_choose(&nothing, &wish, 1, &pick));
    nothing.count = 1;
    nothing.rows[0] = (struct auto_row){"hard", .rmse = NAN, .fixed_ms = 1, .screen_ms = 1};
    CHECK(!auto_choose(&nothing, &wish, 1, &pick));
}

static void check_candidates(void)
{
    static const struct pen_technique_info *const items[] = {
        &hard, &pcss, &plain, &multisample, &raytraced};
    static const struct pen_catalogue catalogue = {items, 5};
    const struct pen_catalogue *with_auto = auto_catalogue(&catalogue);
    char keys[AUTO_MAX_ROWS][AUTO_KEY_BYTES];
    CHECK(with_auto->count == 6);
    CHECK(pen_catalogue_find(with_auto, AUTO_NAME) == with_auto->items[5]);
    CHECK(auto_candidates(with_auto, false, false, keys) == 5);
    CHECK_STR(keys[0], "hard");
    CHECK_STR(keys[1], "pcss");
    CHECK_STR(keys[2], "multisample samples=64");
    CHECK_STR(keys[3], "multisample samples=256");
    CHECK_STR(keys[4], "raytraced samples=16");
    CHECK(auto_candidates(with_auto, true, false, keys) == 3); /* colours */
    CHECK(auto_candidates(with_auto, true, true, keys) == 1);
    CHECK_STR(keys[0], "raytraced samples=16");

    struct pen_request request = {0};
    CHECK(auto_apply("multisample samples=64", &catalogue, &request));
    CHECK_STR(request.technique, "multisample");
    CHECK(request.technique_params[0] == 64);
    CHECK(auto_apply("hard", &catalogue, &request));
    CHECK(request.technique_params[0] == 0);
    static const char *const bad[] = {"", "soft", "hard samples=1", "multisample samples",
        "multisample samples=0", "multisample samples=x"};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
        CHECK(!auto_apply(bad[i], &catalogue, &request));
}

/* The store keeps tables per view, device and build. */
static void check_store(const char *folder)
{
    struct pen_error error = {0};
    struct store_staging staging;
    struct scene_store *store = scene_store_open(folder, 0, &error);
    CHECK(store != NULL);
    if (!store)
        return;
    uint8_t scene[PEN_ID_BYTES] = {1};
    struct pen_device_info device = {.renderer = "one"}, other = {.renderer = "two"};
    struct auto_table mine = table, got;
    mine.setup[0] = 7;
    CHECK(!load(store, scene, &device, &mine, true, &got));
    CHECK(!calibration_save(store, scene, &device, &mine)); /* no such scene */
    bool added = false;
    CHECK(scene_store_stage(store, &staging, &error));
    const char *names[] = {STORE_SOURCE, STORE_META, scene_store_blob_name(STORE_SCENES)};
    for (int i = 0; i < 3; i++) {
        char path[512];
        snprintf(path, sizeof path, "%s/tmp/%s/%s", folder, staging.name, names[i]);
        FILE *file = fopen(path, "w");
        CHECK(file && fputs("x", file) >= 0 && !fclose(file));
    }
    CHECK(scene_store_commit(store, STORE_SCENES, &staging, scene, &added, &error) && added);
    CHECK(calibration_save(store, scene, &device, &mine));
    CHECK(load(store, scene, &device, &mine, false, &got) && !got.borrowed);
    CHECK(got.count == mine.count && got.pixels == mine.pixels);
    for (uint32_t i = 0; i < got.count; i++) {
        CHECK_STR(got.rows[i].key, mine.rows[i].key);
        CHECK_NEAR(got.rows[i].rmse, mine.rows[i].rmse, 1e-7);
        CHECK_NEAR(got.rows[i].screen_ms, mine.rows[i].screen_ms, 1e-5);
    }
    CHECK(!load(store, scene, &other, &mine, true, &got));
    /* Other views push the oldest out. */
    for (uint8_t i = 0; i < CALIBRATION_TABLES; i++) {
        mine.setup[0] = (uint8_t)(8 + i);
        CHECK(calibration_save(store, scene, &device, &mine));
    }
    mine.setup[0] = 7;
    CHECK(!load(store, scene, &device, &mine, false, &got));
    CHECK(load(store, scene, &device, &mine, true, &got) && got.borrowed);
    CHECK(got.setup[0] == 7 + CALIBRATION_TABLES);
    mine.cost[0] = 1; /* more lights, say */
    CHECK(!load(store, scene, &device, &mine, true, &got));
    CHECK(scene_store_remove(store, STORE_SCENES, scene, &error));
    mine.cost[0] = 0;
    CHECK(!load(store, scene, &device, &mine, true, &got));
    scene_store_close(store);
}

/* Which of the two hashes a change of the request changes. */
static void check_change(
    const struct pen_request *a, const struct pen_request *b, bool setup, bool cost)
{
    uint8_t of_a[2][PEN_ID_BYTES], of_b[2][PEN_ID_BYTES];
    calibration_setup(a, of_a[0], of_a[1]);
    calibration_setup(b, of_b[0], of_b[1]);
    CHECK((memcmp(of_a[0], of_b[0], PEN_ID_BYTES) != 0) == setup);
    CHECK((memcmp(of_a[1], of_b[1], PEN_ID_BYTES) != 0) == cost);
}

static void check_setup(void)
{
    const struct pen_request a = {
        .width = 800, .height = 600, .antialias = 1, .lights_given = 1, .light_count = 1};
    struct pen_request b = a;
    b.width = 400, b.height = 300, b.exposure_ev = 2;
    memcpy(b.technique, "pcss", 4);
    b.technique_params[3] = 9;
    b.delivery.deadline_ms = 5;
    check_change(&a, &b, false, false);
    b.camera.eye[0] = 1;
    check_change(&a, &b, true, false);
    b = a;
    b.lights[0].position[1] = 3, b.lights[0].power_w = 10;
    check_change(&a, &b, true, false);
    b = a;
    b.lights[0].width = 2;
    check_change(&a, &b, true, true);
    b = a;
    b.light_count = 2;
    check_change(&a, &b, true, true);
    b = a;
    b.height = 300;
    check_change(&a, &b, true, true);
    b = a;
    b.antialias = 4;
    check_change(&a, &b, true, true);
}

int main(void)
{
    char folder[] = "/tmp/penumbra-auto-XXXXXX";
    check_prediction();
    check_error();
    check_budget();
    check_both();
    check_observations();
    check_shared_observations();
    check_history();
    check_borrowed();
    check_empty();
    check_candidates();
    check_setup();
    if (mkdtemp(folder)) {
        char command[64];
        check_store(folder);
        snprintf(command, sizeof command, "rm -r %s", folder);
        CHECK(!system(command));
    }
    CHECK_DONE();
}
