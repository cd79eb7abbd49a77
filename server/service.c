#include "server/service.h"
#include "protocol/json_result.h"
#include "protocol/memory.h"
#include "protocol/openapi.h"
#include "renderer/blob/builder.h"
#include "server/auto/choice.h"
#include "server/base/clock.h"
#include "server/base/file.h"
#include "server/base/hash.h"
#include "server/base/log.h"
#include "server/base/process.h"
#include "server/routes/routes.h"
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#define FEED_MS 1000     /* between live figures */
#define STRAGGLER_MS 200 /* requests on their way when the last answer is out */
#define CANCEL_MS 10000
/* Descriptors that public connections leave to the rest of the daemon, and those that each listener
 * keeps for when there are no more: a request takes three. */
#define SPARE_DESCRIPTORS 16
#define PUBLIC_SPARES 1
#define ADMIN_SPARES 6
#define PART_CACHE_BYTES                                                                           \
    (64u << 20) /* links to pictures that get better hold as long as they fit */

/* ---- what the pool asks for ---- */

static bool open_job(
    void *context, struct channel_job *job, struct channel_fds *fds, struct pen_error *error)
{
    struct service *s = context;
    bool canary = !memcmp(job->request.scene, s->canary_id, PEN_ID_BYTES);
    int fd = canary ? fcntl(s->canary_blob, F_DUPFD_CLOEXEC, 3)
                    : scene_store_open_blob(s->store, STORE_SCENES, job->request.scene, error);
    if (fd < 0) /* why the store gave none, it has said */
        return pen_fail(error, PEN_UNAVAILABLE, "", "The service is out of descriptors.");
    fds->fd[fds->count++] = fd;
    for (uint32_t i = 0; i < job->request.light_count; i++) {
        const struct pen_light *light = &job->request.lights[i];
        bool known = light->texture != PEN_TEXTURE_IMAGE;
        for (uint32_t k = 0; k < job->image_count; k++)
            known = known || !memcmp(job->images[k], light->image, PEN_ID_BYTES);
        if (known)
            continue;
        fd = scene_store_open_blob(s->store, STORE_IMAGES, light->image, error);
        if (fd < 0)
            return false;
        memcpy(job->images[job->image_count++], light->image, PEN_ID_BYTES);
        fds->fd[fds->count++] = fd;
    }
    return true;
}

static void on_picture(void *context, struct picture *picture)
{
    struct service *s = context;
    if (!memcmp(picture->result.completed.scene, s->canary_id, PEN_ID_BYTES))
        return;
    metrics_render(s->metrics, &picture->result);
    if (!pen_request_is_stateful(&picture->result.completed, s->catalogue))
        result_cache_put(s->cache, picture);
}

static void on_measured(void *context, const struct pen_result *result)
{
    struct service *s = context;
    metrics_render(s->metrics, result);
}

static void on_work(void *context)
{
    struct service *s = context;
    if (s->pool)
        worker_pool_wake(s->pool);
}

/* ---- start ---- */

/* A square receiver: the smallest scene that goes through every pass. */
static bool make_canary(struct service *s, struct pen_error *error)
{
    static const float corners[4][3] = {{-1, 0, -1}, {-1, 0, 1}, {1, 0, 1}, {1, 0, -1}};
    static const uint32_t indices[6] = {0, 1, 2, 0, 2, 3};
    static const float world[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    struct psc_builder *builder = psc_builder_create();
    struct psc_material material = psc_material_default();
    struct psc_mesh mesh = {
        .positions = corners, .vertex_count = 4, .indices = indices, .index_count = 6};
    uint32_t primitive;
    void *data = NULL;
    size_t bytes;
    memset(s->canary_id, 0xca, PEN_ID_BYTES); /* no hash of anything */
    mesh.material = psc_builder_add_material(builder, &material);
    bool ok = psc_builder_add_mesh(builder, &mesh, &primitive, error);
    if (ok)
        psc_builder_add_instance(builder, primitive, world);
    ok = ok && psc_builder_finish(builder, s->canary_id, &data, &bytes, error);
    psc_builder_destroy(builder);
    s->canary_blob = memfd_create("penumbra-canary", MFD_CLOEXEC);
    if (ok && (s->canary_blob < 0 || write(s->canary_blob, data, bytes) != (ssize_t)bytes))
        ok = pen_fail(error, PEN_UNAVAILABLE, "", "The service is out of memory.");
    free(data);
    return ok;
}

/* The program that makes the pixels, hashed: part of every tag. */
static bool name_build(const char *worker_path, struct pen_error *error)
{
    char piece[1 << 16], text[PEN_ID_HEX + 1];
    uint8_t digest[PEN_ID_BYTES];
    struct hash *hash = hash_create();
    FILE *file = fopen(worker_path, "re");
    size_t n;
    while (file && (n = fread(piece, 1, sizeof piece, file)))
        hash_add(hash, piece, n);
    hash_finish(hash, digest);
    pen_id_to_hex(digest, text);
    picture_set_build(text);
    if (!file)
        return pen_fail(error, PEN_UNAVAILABLE, "", "%.200s cannot be read.", worker_path);
    fclose(file);
    return true;
}

static bool is_loopback(const char *listen_on)
{
    return !strncmp(listen_on, "127.", 4) || !strncmp(listen_on, "[::1]", 5) ||
           !strncmp(listen_on, "localhost:", 10);
}

static bool find_program(
    const char *set, const char *name, char *path, size_t bytes, struct pen_error *error)
{
    if (*set)
        snprintf(path, bytes, "%s", set);
    else if (!process_find_sibling(name, path, bytes))
        return pen_fail(error, PEN_INTERNAL, "", "%s is not installed.", name);
    if (access(path, X_OK))
        return pen_fail(error, PEN_UNAVAILABLE, "", "%.200s cannot be run.", path);
    return true;
}

static void finish_refresh(struct import_task *task)
{
    char id[PEN_ID_HEX + 1];
    pen_id_to_hex(task->id, id);
    if (task->error.code)
        log_event(LOG_ERROR, "importing %s again failed: %s", id, task->error.message);
    free(task);
}

/* Of an older version, or damaged: made again from its source. Workers may have it mapped. */
static void import_again(void *context, enum store_kind kind, const uint8_t id[PEN_ID_BYTES])
{
    struct service *s = context;
    struct import_task *task = pen_alloc_zero(1, sizeof *task);
    task->kind = kind;
    task->finish = finish_refresh;
    memcpy(task->id, id, PEN_ID_BYTES);
    if (!importer_submit(s->importer, task, NULL)) {
        scene_store_not_refreshed(s->store, kind, id, false);
        free(task);
    }
    if (kind == STORE_SCENES && s->pool)
        worker_pool_drop_scene(s->pool, id);
}

static bool start_importer(struct service *s, struct pen_error *error)
{
    const struct config *c = s->config;
    struct importer_config config = {.store = s->store,
        .processes = (uint32_t)c->imports,
        .queue_limit = 2 * (uint32_t)c->uploads,
        .timeout_ms = c->import_timeout_ms,
        .memory_bytes = c->import_memory.bytes,
        .cpu_seconds = c->import_cpu_seconds};
    if (!find_program(c->import_path, "penumbra-import", config.import_path,
            sizeof config.import_path, error))
        return false;
    s->importer = importer_create(&config);
    scene_store_on_stale(s->store, import_again, s);
    s->scrubber = scrubber_create(s->store, c->scrub_s);
    return true;
}

static bool start_pool(struct service *s, struct pen_error *error)
{
    const struct config *c = s->config;
    struct worker_pool_config config = {.workers = (uint32_t)c->workers,
        .catalogue = s->catalogue,
        .warm_up = c->warm_up.on,
        .hang_timeout_ms = c->hang_timeout_ms,
        .silence_timeout_ms = c->silence_timeout_ms,
        .quarantine_s = c->quarantine_s,
        .scheduler = s->scheduler,
        .open_job = open_job,
        .on_picture = on_picture,
        .on_measured = on_measured,
        .context = s,
        .renderer = {.device = {.choice = c->device.index,
                         .index = (uint32_t)c->device_index,
                         .require_gpu = c->require_gpu.on,
                         .debug = c->gl_debug.on},
            .gpu_memory_bytes = c->gpu_memory.bytes}};
    if (!find_program(c->worker_path, "penumbra-worker", config.worker_path,
            sizeof config.worker_path, error) ||
        !name_build(config.worker_path, error))
        return false;
    s->pool = worker_pool_create(&config);
    return true;
}

static bool read_device(void *context, struct pen_device_info *device)
{
    struct service *s = context;
    struct worker_pool_numbers numbers;
    worker_pool_read(s->pool, &numbers);
    *device = numbers.device;
    return numbers.has_device;
}

static void start_jobs(struct service *s)
{
    const struct config *c = s->config;
    uint32_t in_flight = (uint32_t)(c->queue_limit / 4);
    struct jobs_config config = {.store = c->store,
        .scheduler = s->scheduler,
        .cache = s->cache,
        .makers = {s->catalogue, AUTO_NAME},
        .limits = {.active = (uint32_t)c->jobs,
            .active_per_client = (uint32_t)c->jobs_share,
            .kept = (uint32_t)c->jobs_kept,
            .kept_per_client = (uint32_t)(c->jobs_kept + 3) / 4,
            .bytes = c->jobs_limit.bytes},
        .workers = (uint32_t)c->workers,
        .in_flight = in_flight ? in_flight : 1,
        .keep_s = c->jobs_keep_s,
        .read_device = read_device,
        .context = s};
    s->jobs = jobs_create(&config);
}

static bool start_listeners(struct service *s, struct pen_error *error)
{
    const struct config *c = s->config;
    struct tls_identity *tls = NULL;
    if (*c->tls_cert && !(tls = tls_identity_load(c->tls_cert, c->tls_key, error)))
        return false;
    struct http_config public = {.callbacks = &routes_callbacks,
        .context = s,
        .threads = (uint32_t)c->http_threads,
        .door = {.name = "public",
            .listen = c->listen,
            .tls = tls,
            .spares = PUBLIC_SPARES,
            .margin = SPARE_DESCRIPTORS,
            .uploads = (uint32_t)c->uploads,
            .connections = (uint32_t)c->connections,
            .connections_per_address = (uint32_t)c->connections_per_address,
            .header_timeout_ms = c->header_timeout_ms,
            .keep_alive_ms = c->keep_alive_ms,
            .body_rate = c->body_rate.bytes}};
    struct http_config admin = {.callbacks = &routes_admin_callbacks,
        .context = s,
        .threads = 1,
        .door = {.name = "admin",
            .listen = c->admin_listen,
            .spares = ADMIN_SPARES,
            .connections = 64,
            .connections_per_address = 64,
            .header_timeout_ms = 5000,
            .keep_alive_ms = 60000,
            .body_rate = 1024}};
    s->listener = http_listener_create(&public, error);
    s->admin = s->listener ? http_listener_create(&admin, error) : NULL; /* it reports on both */
    return s->admin != NULL;
}

static bool open_owners(struct service *s, struct pen_error *error)
{
    char path[CONFIG_TEXT_BYTES + 16];
    snprintf(path, sizeof path, "%s/owners", s->config->store);
    s->owners = owners_open(path, error);
    return s->owners != NULL;
}

void service_reload(struct service *s)
{
    const struct config *c = s->config;
    struct pen_error error = {0};
    struct tls_identity *tls = NULL;
    /* What can fail first: all of it is changed, or nothing. */
    bool ok = (!*c->tls_cert || (tls = tls_identity_load(c->tls_cert, c->tls_key, &error))) &&
              (!s->auth || auth_reload(s->auth, c->token_file, &error));
    if (ok && tls)
        door_set_tls(http_listener_door(s->listener), tls);
    else
        tls_identity_destroy(tls);
    if (ok)
        log_event(LOG_INFO, "tokens and certificates were read again");
    else
        log_event(LOG_ERROR, "nothing is changed: %s", error.message);
}

struct service *service_create(
    const struct config *config, const struct pen_catalogue *catalogue, struct pen_error *error)
{
    struct service *s = pen_alloc_zero(1, sizeof *s);
    s->config = config;
    s->catalogue = catalogue = auto_catalogue(catalogue);
    s->started_ns = clock_now_ns();
    s->canary_blob = -1;
    pthread_mutex_init(&s->canary_lock, NULL);
    struct rlimit files;
    if (!getrlimit(RLIMIT_NOFILE, &files)) {
        files.rlim_cur = files.rlim_max;
        setrlimit(RLIMIT_NOFILE, &files);
    }
    if (!is_loopback(config->listen) && !*config->token_file && !config->insecure.on) {
        pen_fail(error, PEN_INVALID, "",
            "Beyond loopback --token-file is needed, or --insecure if that is meant.");
        goto fail;
    }
    if (!proxy_split_url(config->public_url, s->public_name, s->public_prefix, error) ||
        !proxy_check_list(config->trusted_proxy, error))
        goto fail;
    s->admin_is_open = is_loopback(config->admin_listen);
    if (!s->admin_is_open && !*config->token_file && !config->insecure.on) {
        pen_fail(error, PEN_INVALID, "",
            "Beyond loopback the admin listener needs --token-file, whose tokens with \"admin\" "
            "see "
            "the metrics, or --insecure if that is meant.");
        goto fail;
    }
    if (*config->token_file && !(s->auth = auth_load(config->token_file, error)))
        goto fail;
    pages_make(&s->openapi, PAGE_JSON, pen_openapi_json(catalogue, PENUMBRA_VERSION));
    pages_make(&s->techniques, PAGE_JSON, pen_techniques_json(catalogue));
    if (!make_canary(s, error) ||
        !(s->store = scene_store_open(config->store, config->store_limit.bytes, error)) ||
        (s->auth && !open_owners(s, error)))
        goto fail;
    s->labels = labels_open(s->store);
    struct scheduler_limits limits = {.queue = (uint32_t)config->queue_limit,
        .client_share = (uint32_t)config->client_share,
        .workers = (uint32_t)config->workers,
        .catalogue = catalogue};
    s->metrics = metrics_create(catalogue);
    s->cache = result_cache_create(config->result_cache.bytes);
    s->part_cache = result_cache_create(PART_CACHE_BYTES);
    s->scheduler = scheduler_create(&limits, on_work, s);
    /* As many again as are served: until those that keep one for little have left it. */
    s->places = places_create(2 * (uint32_t)config->uploads);
    s->feed = feed_create("stats", FEED_MS, routes_live_json, s);
    s->auto_runs = auto_runs_create(&(struct auto_parts){s->scheduler, s->store, catalogue});
    if (!start_importer(s, error) || !start_pool(s, error))
        goto fail;
    start_jobs(s);
    if (!start_listeners(s, error))
        goto fail;
    return s;
fail:
    service_destroy(s, &(bool){true});
    return NULL;
}

/* ---- stop ---- */

static uint32_t active(const struct service *s)
{
    return (s->listener ? http_listener_active(s->listener) : 0);
}

static void drain(struct service *s, const bool *hurry)
{
    __atomic_store_n(&s->draining, true, __ATOMIC_RELEASE);
    if (s->listener)
        http_listener_drain(s->listener);
    jobs_drain(s->jobs);
    feed_close(s->feed);
    uint64_t end = clock_now_ns() + s->config->drain_timeout_ms * CLOCK_MS, quiet = 0;
    while (clock_now_ns() < end && !__atomic_load_n(hurry, __ATOMIC_ACQUIRE)) {
        uint64_t now = clock_now_ns();
        if (active(s))
            quiet = 0;
        else if (!quiet)
            quiet = now;
        else if (now - quiet > STRAGGLER_MS * CLOCK_MS)
            break;
        usleep(5000);
    }
    if (s->scheduler)
        scheduler_drain(s->scheduler);
    if (s->importer)
        importer_cancel(s->importer);
    /* What is left is answered with 503; a resumed connection may only then be stopped. */
    end = clock_now_ns() + CANCEL_MS * CLOCK_MS;
    do {
        if (s->scheduler)
            scheduler_cancel(s->scheduler);
        usleep(2000);
    } while ((active(s) || (s->admin && http_listener_active(s->admin))) && clock_now_ns() < end);
}

void service_destroy(struct service *s, const bool *hurry)
{
    if (!s)
        return;
    drain(s, hurry);
    scrubber_destroy(s->scrubber);
    if (s->importer)
        importer_stop(s->importer);
    if (s->admin)
        http_listener_drain(s->admin);
    if (s->scheduler)
        scheduler_cancel(s->scheduler);
    http_listener_destroy(s->listener);
    http_listener_destroy(s->admin);
    feed_destroy(s->feed);
    jobs_destroy(s->jobs);
    worker_pool_destroy(s->pool);
    importer_destroy(s->importer); /* the pool's threads may still have asked for imports */
    scheduler_destroy(s->scheduler);
    places_destroy(s->places);
    result_cache_destroy(s->cache);
    result_cache_destroy(s->part_cache);
    metrics_destroy(s->metrics);
    labels_close(s->labels);
    scene_store_close(s->store);
    if (s->canary_blob >= 0)
        close(s->canary_blob);
    auto_runs_destroy(s->auto_runs);
    auth_destroy(s->auth);
    owners_close(s->owners);
    pages_unmake(&s->openapi);
    pages_unmake(&s->techniques);
    pthread_mutex_destroy(&s->canary_lock);
    free(s);
}
