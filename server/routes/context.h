/* What the routes work with: the parts of the running daemon. service.c makes and ends them. */
#pragma once
#include "protocol/technique_info.h"
#include "server/auto/render.h"
#include "server/base/config.h"
#include "server/base/metrics.h"
#include "server/access/auth.h"
#include "server/access/owners.h"
#include "server/access/proxy.h"
#include "server/http/http.h"
#include "server/jobs/jobs.h"
#include "server/gallery/labels.h"
#include "server/live/feed.h"
#include "server/pages/pages.h"
#include "server/queue/scheduler.h"
#include "server/uploads/importer.h"
#include "server/uploads/places.h"
#include "server/store/scrubber.h"
#include "server/store/result_cache.h"
#include "server/store/scene_store.h"
#include "server/workers/worker_pool.h"
#include <pthread.h>

struct service {
    /* Constant after service_create. */
    const struct config *config;
    const struct pen_catalogue *catalogue;
    struct scene_store *store;
    struct labels *labels; /* of scenes */
    struct importer *importer;
    struct scrubber *scrubber;
    struct scheduler *scheduler;
    struct worker_pool *pool;
    struct result_cache *cache, *part_cache; /* pictures; those that got better since */
    struct metrics *metrics;
    struct auto_runs *auto_runs;
    struct jobs *jobs;
    struct feed *feed;     /* of what the service counts */
    struct auth *auth;     /* NULL: no token is asked for */
    struct owners *owners; /* NULL likewise */
    char public_name[PROXY_NAME_BYTES], public_prefix[PROXY_PREFIX_BYTES]; /* of --public-url */
    bool admin_is_open; /* the admin listener asks for no token */
    struct http_listener *listener, *admin;
    struct page_file openapi, techniques; /* documents that never change */
    uint64_t started_ns;
    int canary_blob; /* a plane, as a blob in a memfd */
    uint8_t canary_id[PEN_ID_BYTES];

    bool draining;                       /* atomic */
    struct places *places;               /* of uploads under way */
    uint64_t bytes_received, bytes_sent; /* atomic, public listener */

    pthread_mutex_t canary_lock; /* guards the two below */
    uint64_t canary_ns;          /* when the canary was last rendered; 0: never */
    bool canary_failed;
};

static inline bool service_is_draining(const struct service *service)
{
    return __atomic_load_n(&service->draining, __ATOMIC_ACQUIRE);
}
