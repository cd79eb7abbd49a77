/* penumbrad: settings, signals, and the life of the service. */
#include "protocol/openapi.h"
#include "renderer/catalogue/catalogue.h"
#include "server/auto/choice.h"
#include "server/base/log.h"
#include "server/service.h"
#include <errno.h>
#include <pthread.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define EXIT_SETTINGS 2
#define EXIT_NO_DEVICE 3

static bool hurry; /* atomic: a second signal came */

/* Waits for the second SIGTERM while the first is being honoured. */
static void *wait_for_second(void *argument)
{
    const sigset_t *signals = argument;
    int which;
    sigwait(signals, &which);
    if (which == SIGUSR1)
        return NULL; /* it is over already */
    log_event(LOG_INFO, "second signal: what still runs is given up");
    __atomic_store_n(&hurry, true, __ATOMIC_RELEASE);
    return NULL;
}

/* Returns when a signal came (true) or when there is no device to render on (false). */
static bool run(struct service *service, const sigset_t *signals)
{
    const struct timespec tick = {0, 100000000};
    for (;;) {
        struct worker_pool_numbers pool;
        int which = sigtimedwait(signals, NULL, &tick);
        if (which == SIGHUP) {
            service_reload(service);
        } else if (which > 0) {
            log_event(LOG_INFO, "signal %d: draining", which);
            return true;
        }
        worker_pool_read(service->pool, &pool);
        if (!pool.has_device && pool.refused.code != PEN_OK) {
            log_event(LOG_ERROR, "no device to render on: %s", pool.refused.message);
            return false;
        }
    }
}

int main(int argc, char **argv)
{
    static struct config config;
    struct pen_error error = {0};
    if (config_answer_help(argc, argv))
        return 0;
    if (!config_read(&config, argc, argv, &error)) {
        fprintf(stderr, "penumbrad: %s\n", error.message);
        return EXIT_SETTINGS;
    }
    if (config.print_config.on) {
        config_print(&config, stdout);
        return 0;
    }
    if (config.print_openapi.on) {
        char *document = pen_openapi_json(auto_catalogue(&pen_catalogue), PENUMBRA_VERSION);
        puts(document);
        free(document);
        return 0;
    }
    log_init(config.log_format.index);
    /* For the workers. On a software device textures are cleared memory, and to get that in large
     * pages takes a fifth of the time. Given back it leaves the process, whatever its size was: else
     * a large one that has gone makes glibc keep what comes later. */
    setenv("GLIBC_TUNABLES",
        "glibc.malloc.hugetlb=1:glibc.malloc.mmap_threshold=262144:"
        "glibc.malloc.trim_threshold=4194304:glibc.malloc.mmap_max=1000000:"
        "glibc.malloc.arena_max=4",
        0);
    static sigset_t signals;
    sigemptyset(&signals);
    sigaddset(&signals, SIGTERM);
    sigaddset(&signals, SIGINT);
    sigaddset(&signals, SIGUSR1);
    sigaddset(&signals, SIGHUP);
    pthread_sigmask(SIG_BLOCK, &signals, NULL); /* before any thread, so that all inherit it */
    sigdelset(&signals, SIGUSR1);
    signal(SIGPIPE, SIG_IGN);
    struct service *service = service_create(&config, &pen_catalogue, &error);
    if (!service) {
        fprintf(stderr, "penumbrad: %s\n", error.message);
        return EXIT_SETTINGS;
    }
    printf("penumbrad %s listens on %s://%s (admin: http://%s)\n", PENUMBRA_VERSION,
        *config.tls_cert ? "https" : "http", door_address(http_listener_door(service->listener)),
        door_address(http_listener_door(service->admin)));
    fflush(stdout);
    bool asked = run(service, &signals);
    pthread_t second;
    sigaddset(&signals, SIGUSR1);
    sigdelset(&signals, SIGHUP);
    if (pthread_create(&second, NULL, wait_for_second, &signals))
        abort();
    service_destroy(service, &hurry);
    pthread_kill(second, SIGUSR1); /* if it still waits */
    pthread_join(second, NULL);
    log_event(LOG_INFO, "stopped");
    return asked ? 0 : EXIT_NO_DEVICE;
}
