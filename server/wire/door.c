#include "server/wire/door.h"
#include "protocol/memory.h"
#include "server/base/clock.h"
#include "server/base/log.h"
#include "server/base/status.h"
#include "server/wire/address.h"
#include "server/wire/crowd.h"
#include "server/wire/spares.h"
#include <errno.h>
#include <poll.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#define TICK_MS 100
#define BACKLOG 512
#define EVENTS 64
#define ACCEPTED_AT_ONCE 64
#define SLOW_AT_ONCE 16 /* of those that are slow, then the quick have their turn */
#define MAX_DYING 64    /* beyond the connections: they were refused, and are to hear of it */
#define PAIR 2          /* descriptors of a request, besides its client's */

struct door {
    struct door_config config;
    struct link_config links_config;
    char address[128];
    int listen_fd; /* the thread's; -1 once closed */
    int wake, epoll;
    bool deaf; /* the listening socket is not listened to until the next tick */
    struct spares spares;
    pthread_t thread;
    bool started;
    struct crowd crowd; /* the thread's, as is: */
    struct link *buried;

    pthread_mutex_t lock; /* guards everything below */
    pthread_cond_t closed_changed;
    struct link **far; /* whose far end a descriptor is */
    int far_capacity;
    struct link *noted; /* are to be looked at */
    struct door_numbers numbers;
    bool closing, closed, ending_idle, stopping;
};

static void wake(struct door *door)
{
    uint64_t one = 1;
    if (write(door->wake, &one, sizeof one) < 0 && errno != EAGAIN)
        abort();
}

static void relieve(void *context)
{
    struct door *door = context;
    spares_give(&door->spares, PAIR);
}

/* ---- links ---- */

/* Takes a dead link out of the table; it is freed when no event and no note can name it any more. */
static void bury(struct door *door, struct link *link)
{
    if (link->buried)
        return;
    link->buried = true;
    crowd_leave(&door->crowd, link);
    pthread_mutex_lock(&door->lock);
    door->numbers.open--;
    pthread_mutex_unlock(&door->lock);
    link->next_buried = door->buried;
    door->buried = link;
}

static void free_buried(struct door *door)
{
    struct link **at = &door->buried;
    while (*at) {
        struct link *link = *at;
        pthread_mutex_lock(&door->lock);
        bool noted = link->noted;
        pthread_mutex_unlock(&door->lock);
        if (noted) {
            at = &link->next_buried;
            continue;
        }
        *at = link->next_buried;
        link_destroy(link);
    }
}

static void pump(struct door *door, struct link *link, uint32_t events)
{
    if (!link->buried)
        link_pump(link, events);
    crowd_look(&door->crowd, link);
    if (link->state == LINK_DEAD)
        bury(door, link);
}

/* Makes room; false: everybody is needed where they are. */
static bool displace(struct door *door, const struct crowd_wanted *wanted)
{
    struct link *link = crowd_find_idlest(&door->crowd, wanted, clock_now_ns());
    struct pen_error error = {0};
    if (!link)
        return false;
    pthread_mutex_lock(&door->lock);
    door->numbers.displaced += link->state < LINK_ENDING;
    pthread_mutex_unlock(&door->lock);
    if (link->state == LINK_HEAD || link->state == LINK_BODY) {
        pen_fail(&error, PEN_TIMEOUT, "",
            "The request came too slowly: others that are faster needed the place.");
        link_refuse(link, &error);
        link_pump(link, 0);
    }
    if (link->state != LINK_LINGERING || wanted->dying)
        link_cut(link);
    crowd_look(&door->crowd, link);
    if (link->state == LINK_DEAD)
        bury(door, link);
    return true;
}

/* ---- what links ask for ---- */

static void open_far(void *context, struct link *link, int far)
{
    struct door *door = context;
    const struct sockaddr_storage *from = &link->from;
    pthread_mutex_lock(&door->lock);
    if (far >= door->far_capacity) {
        int capacity = far * 2 + 64;
        door->far = pen_realloc_array(door->far, (size_t)capacity, sizeof *door->far);
        memset(door->far + door->far_capacity, 0,
            (size_t)(capacity - door->far_capacity) * sizeof *door->far);
        door->far_capacity = capacity;
    }
    door->far[far] = link;
    door->numbers.engaged++;
    pthread_mutex_unlock(&door->lock);
    door->config.on_socket(door->config.context, far, (const struct sockaddr *)from,
        from->ss_family == AF_INET6 ? sizeof(struct sockaddr_in6) : sizeof(struct sockaddr_in));
}

static void detach_far(void *context, struct link *link, int far)
{
    struct door *door = context;
    pthread_mutex_lock(&door->lock);
    if (door->far[far] == link)
        door->far[far] = NULL;
    door->numbers.engaged--;
    pthread_mutex_unlock(&door->lock);
}

static void note_refusal(
    void *context, const struct link *link, const struct pen_error *error, const char *request_id)
{
    struct door *door = context;
    char client[64] = "unknown";
    const struct sockaddr_storage *from = &link->from;
    getnameinfo((const struct sockaddr *)from,
        from->ss_family == AF_INET6 ? sizeof(struct sockaddr_in6) : sizeof(struct sockaddr_in),
        client, sizeof client, NULL, 0, NI_NUMERICHOST);
    pthread_mutex_lock(&door->lock);
    door->numbers.too_slow += error->code == PEN_TIMEOUT;
    door->numbers.malformed += error->code != PEN_TIMEOUT && error->code != PEN_UNAVAILABLE;
    pthread_mutex_unlock(&door->lock);
    struct log_request line = {.listener = door->config.name,
        .request_id = request_id,
        .client = client,
        .method = "-",
        .target = "-",
        .status = http_status_of(error->code).status,
        .code = error->code,
        .error = error->message,
        .ms = clock_ms(clock_now_ns() - link->since_ns)};
    log_write_request(&line);
}

/* ---- accepting ---- */

/* A connection more than there is room for is told so by an answer that waits for nothing. */
static void turn_away(struct door *door, struct link *link, bool of_address)
{
    struct pen_error error = {0};
    pen_fail(
        &error, of_address ? PEN_TOO_MANY : PEN_UNAVAILABLE, "", "There are too many connections.");
    pthread_mutex_lock(&door->lock);
    door->numbers.refused++;
    pthread_mutex_unlock(&door->lock);
    link_refuse(link, &error);
}

static void admit(struct door *door, int fd, const struct sockaddr_storage *from)
{
    const struct door_config *config = &door->config;
    struct in6_addr address = address_network(from);
    struct peer *peer = peers_enter(&door->crowd.peers, &address);
    const struct crowd_wanted of_address = {.peer = peer}, of_all = {0},
                              descriptors = {.dying = true};
    bool crowded = peer->live >= config->connections_per_address && !displace(door, &of_address);
    bool fits = !crowded && (door->crowd.live < config->connections || displace(door, &of_all)) &&
                (fd <= door->links_config.highest - PAIR || displace(door, &descriptors));
    if (door->crowd.count > config->connections + MAX_DYING)
        displace(door, &descriptors);
    pthread_mutex_lock(&door->lock);
    struct tls *tls = config->tls ? tls_create(config->tls, fd) : NULL;
    bool lost = config->tls && !tls;
    door->numbers.accepted += fits;
    door->numbers.open++;
    pthread_mutex_unlock(&door->lock);
    struct link *link = link_create(&door->links_config, fd, from, tls);
    crowd_enter(&door->crowd, link, peer);
    if (lost)
        link_cut(link);
    else if (!fits)
        turn_away(door, link, crowded);
    pump(door, link, 0);
}

/* accept4 wants a descriptor before it looks whether anybody is there. */
static bool is_queued(const struct door *door)
{
    struct pollfd watch = {door->listen_fd, POLLIN, 0};
    return poll(&watch, 1, 0) > 0;
}

/* Accepts what is queued, or some of it: the rest has its turn after what moves already. False: there are
 * no descriptors, and (may_free) none could be had: as long as events name links, none is freed. */
static bool accept_some(struct door *door, uint32_t most, bool may_free)
{
    bool helped = false;
    for (uint32_t i = 0; i < most; i++) {
        struct sockaddr_storage from;
        socklen_t bytes = sizeof from;
        int fd = accept4(
            door->listen_fd, (struct sockaddr *)&from, &bytes, SOCK_CLOEXEC | SOCK_NONBLOCK);
        bool starved = fd < 0 && spares_are_needed();
        if (starved && !is_queued(door))
            return true;
        if (starved && !may_free)
            return false;
        if (starved && !helped) {
            /* Those in the queue have waited long enough: somebody else makes room, or a spare. */
            helped = true;
            displace(door, &(struct crowd_wanted){.dying = true});
            free_buried(door);
            spares_give(&door->spares, 1);
            continue;
        }
        if (starved)
            door->deaf = true; /* trying at once would spin */
        if (starved)
            return false;
        if (fd < 0 && (errno == EINTR || errno == ECONNABORTED))
            continue;
        if (fd < 0)
            return true;
        int one = 1;
        setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &one, sizeof one);
        admit(door, fd, &from);
    }
    return true;
}

static void listen_or_not(struct door *door, bool deaf)
{
    struct epoll_event event = {.events = deaf ? 0 : EPOLLIN, .data.ptr = &door->listen_fd};
    if (door->listen_fd >= 0 && epoll_ctl(door->epoll, EPOLL_CTL_MOD, door->listen_fd, &event))
        abort();
    door->deaf = deaf;
}

/* ---- the thread ---- */

/* Ends what is too slow, and of uploads beyond their places those that keep one for little. */
static void reap(struct door *door)
{
    uint32_t uploads = 0;
    uint64_t now = clock_now_ns();
    for (uint32_t i = door->crowd.count; i-- > 0;) {
        struct link *link = door->crowd.links[i];
        link_check(link, now);
        crowd_look(&door->crowd, link);
        uploads += link->state == LINK_BODY &&
                   __atomic_load_n(&link->notes, __ATOMIC_ACQUIRE) & LINK_UPLOADS;
        if (link->state == LINK_DEAD)
            bury(door, link);
    }
    const struct crowd_wanted slow_uploads = {.uploads = true};
    while (door->config.uploads && uploads > door->config.uploads && displace(door, &slow_uploads))
        uploads--;
    spares_fill(&door->spares);
    if (door->deaf)
        listen_or_not(door, false);
}

static void look_at_notes(struct door *door)
{
    uint64_t ignored;
    if (read(door->wake, &ignored, sizeof ignored) < 0 && errno != EAGAIN)
        abort();
    for (;;) {
        pthread_mutex_lock(&door->lock);
        struct link *link = door->noted;
        if (link) {
            door->noted = link->next_noted;
            link->noted = false;
        }
        pthread_mutex_unlock(&door->lock);
        if (!link)
            return;
        pump(door, link, 0);
    }
}

static void close_idle(struct door *door)
{
    for (uint32_t i = door->crowd.count; i-- > 0;) {
        if (door->crowd.links[i]->state > LINK_HEAD)
            continue;
        link_cut(door->crowd.links[i]);
        bury(door, door->crowd.links[i]);
    }
}

/* Newcomers and who is quick come first: of those that keep their places for little only some, and the
 * rest when epoll names them again. */
static void serve(struct door *door, const struct epoll_event *events, int count)
{
    bool knocked = false, noted = false;
    uint64_t now = clock_now_ns();
    for (int i = 0; i < count; i++) {
        knocked = knocked || events[i].data.ptr == &door->listen_fd;
        noted = noted || events[i].data.ptr == &door->wake;
    }
    if (noted)
        look_at_notes(door);
    bool starved = knocked && door->listen_fd >= 0 && !accept_some(door, ACCEPTED_AT_ONCE, false);
    uint64_t slow = 0; /* bits: of the events */
    for (int i = 0; i < count; i++) {
        struct link_ear *ear = events[i].data.ptr;
        if (events[i].data.ptr == &door->listen_fd || events[i].data.ptr == &door->wake)
            continue;
        if (link_idleness(ear->link, now) > CROWD_FRESH_NS && !ear->inner)
            slow |= 1ull << i;
        else
            pump(door, ear->link, ear->inner ? 0 : events[i].events);
    }
    for (int i = 0, served = 0; i < count && served < SLOW_AT_ONCE; i++) {
        const struct link_ear *ear = events[i].data.ptr;
        if (!(slow >> i & 1))
            continue;
        pump(door, ear->link, events[i].events);
        served++;
    }
    if (starved)
        accept_some(door, ACCEPTED_AT_ONCE, true);
    if (door->deaf)
        listen_or_not(door, true);
}

static void *run(void *argument)
{
    struct door *door = argument;
    uint64_t last_reap = clock_now_ns();
    for (bool stopping = false; !stopping;) {
        struct epoll_event events[EVENTS];
        int n = epoll_wait(door->epoll, events, EVENTS, TICK_MS);
        serve(door, events, n);
        free_buried(door);
        uint64_t now = clock_now_ns();
        if (now - last_reap > TICK_MS * CLOCK_MS) {
            reap(door);
            last_reap = now;
        }
        pthread_mutex_lock(&door->lock);
        bool close_now = door->closing && !door->closed, end_idle = door->ending_idle;
        stopping = door->stopping;
        pthread_mutex_unlock(&door->lock);
        if (close_now) {
            accept_some(door, BACKLOG, true);
            close(door->listen_fd);
            door->listen_fd = -1;
        }
        if (end_idle)
            close_idle(door);
        if (close_now || end_idle) {
            pthread_mutex_lock(&door->lock);
            door->closed = door->closed || close_now;
            door->ending_idle = door->ending_idle && !end_idle;
            pthread_cond_broadcast(&door->closed_changed);
            pthread_mutex_unlock(&door->lock);
        }
    }
    return NULL;
}

/* ---- from outside ---- */

static void watch(struct door *door, int fd, void *what)
{
    struct epoll_event event = {.events = EPOLLIN, .data.ptr = what};
    if (epoll_ctl(door->epoll, EPOLL_CTL_ADD, fd, &event))
        abort();
}

struct door *door_create(const struct door_config *config, struct pen_error *error)
{
    struct door *door = pen_alloc_zero(1, sizeof *door);
    door->config = *config;
    door->listen_fd = address_listen(config->listen, BACKLOG, door->address, sizeof door->address);
    if (door->listen_fd < 0) {
        pen_fail(error, PEN_UNAVAILABLE, "", "Cannot listen on %.100s: %s.", config->listen,
            errno ? strerror(errno) : "not an address and a port");
        tls_identity_destroy(config->tls);
        free(door);
        return NULL;
    }
    pthread_mutex_init(&door->lock, NULL);
    pthread_cond_init(&door->closed_changed, NULL);
    door->wake = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    door->epoll = epoll_create1(EPOLL_CLOEXEC);
    if (door->wake < 0 || door->epoll < 0)
        abort();
    spares_init(&door->spares, config->spares);
    watch(door, door->listen_fd, &door->listen_fd);
    watch(door, door->wake, &door->wake);
    door->links_config = (struct link_config){.epoll = door->epoll,
        .header_timeout_ms = config->header_timeout_ms,
        .keep_alive_ms = config->keep_alive_ms,
        .body_rate = config->body_rate,
        .open = open_far,
        .detach = detach_far,
        .refused = note_refusal,
        .relieve = relieve,
        .context = door,
        .highest = spares_limit() - 1 - (int)config->margin};
    return door;
}

void door_start(struct door *door)
{
    if (pthread_create(&door->thread, NULL, run, door))
        abort();
    door->started = true;
}

const char *door_address(const struct door *door)
{
    return door->address;
}

void door_set_tls(struct door *door, struct tls_identity *tls)
{
    pthread_mutex_lock(&door->lock);
    struct tls_identity *old = door->config.tls;
    door->config.tls = tls;
    pthread_mutex_unlock(&door->lock);
    tls_identity_destroy(old);
}

void door_note(struct door *door, int fd, uint32_t notes)
{
    pthread_mutex_lock(&door->lock);
    struct link *link = door->far[fd];
    bool looks = link && notes & LINK_DONE && !link->noted;
    if (link)
        __atomic_or_fetch(&link->notes, notes, __ATOMIC_ACQ_REL);
    if (looks) {
        link->noted = true;
        link->next_noted = door->noted;
        door->noted = link;
    }
    pthread_mutex_unlock(&door->lock);
    if (looks)
        wake(door);
}

void door_forget(struct door *door, int fd)
{
    pthread_mutex_lock(&door->lock);
    door->far[fd] = NULL;
    pthread_mutex_unlock(&door->lock);
}

void door_close(struct door *door)
{
    pthread_mutex_lock(&door->lock);
    door->closing = true;
    pthread_mutex_unlock(&door->lock);
    wake(door);
    pthread_mutex_lock(&door->lock);
    while (!door->closed)
        pthread_cond_wait(&door->closed_changed, &door->lock);
    pthread_mutex_unlock(&door->lock);
}

void door_close_idle(struct door *door)
{
    pthread_mutex_lock(&door->lock);
    door->ending_idle = true;
    pthread_mutex_unlock(&door->lock);
    wake(door);
    pthread_mutex_lock(&door->lock);
    while (door->ending_idle)
        pthread_cond_wait(&door->closed_changed, &door->lock);
    pthread_mutex_unlock(&door->lock);
}

void door_destroy(struct door *door)
{
    if (!door)
        return;
    pthread_mutex_lock(&door->lock);
    door->stopping = true;
    pthread_mutex_unlock(&door->lock);
    wake(door);
    if (door->started)
        pthread_join(door->thread, NULL);
    if (door->listen_fd >= 0)
        close(door->listen_fd);
    for (struct link *link = door->noted; link; link = link->next_noted)
        link->noted = false;
    while (door->crowd.count) {
        link_cut(door->crowd.links[door->crowd.count - 1]);
        bury(door, door->crowd.links[door->crowd.count - 1]);
    }
    free_buried(door);
    spares_finish(&door->spares);
    tls_identity_destroy(door->config.tls);
    close(door->wake);
    close(door->epoll);
    pthread_mutex_destroy(&door->lock);
    pthread_cond_destroy(&door->closed_changed);
    crowd_finish(&door->crowd);
    free(door->far);
    free(door);
}

void door_read(struct door *door, struct door_numbers *numbers)
{
    pthread_mutex_lock(&door->lock);
    *numbers = door->numbers;
    pthread_mutex_unlock(&door->lock);
}
