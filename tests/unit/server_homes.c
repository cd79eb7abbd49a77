/* Which worker the frames of a session go to. */
#include "server/base/clock.h"
#include "server/queue/homes.h"
#include "tests/unit/check.h"
#include <stdio.h>

#define MS CLOCK_MS

static struct render frame(uint64_t client, const char *session, uint64_t now_ns)
{
    struct render render = {
        .payer = client, .queued_ns = now_ns, .last_deadline_ns = now_ns + 30 * CLOCK_S};
    snprintf(
        render.request.delivery.session, sizeof render.request.delivery.session, "%s", session);
    return render;
}

static void test_stays(void)
{
    struct homes *h = homes_create();
    uint64_t now = 1000 * CLOCK_S;
    struct render a = frame(1, "a", now), other = frame(2, "a", now), none = frame(1, "", now);
    for (uint32_t worker = 0; worker < 3; worker++) /* nobody has anything */
        CHECK(!homes_is_away(h, &a, worker, now));
    homes_take(h, &a, 1, now);
    homes_take(h, &none, 2, now);
    CHECK(homes_count(h) == 1);
    CHECK(homes_is_away(h, &a, 0, now) && !homes_is_away(h, &a, 1, now));
    CHECK(!homes_is_away(h, &other, 0, now)); /* a name is a client's own */
    CHECK(!homes_is_away(h, &none, 0, now));
    struct render compared = a;
    compared.measure = MEASURE_PICTURE + 1;
    CHECK(!homes_is_away(h, &compared, 0, now));
    /* Others have their own places; one worker's end is not the others'. */
    homes_take(h, &other, 0, now);
    homes_forget(h, 1);
    CHECK(homes_count(h) == 1);
    CHECK(!homes_is_away(h, &a, 0, now) && homes_is_away(h, &other, 1, now));
    homes_destroy(h);
}

/* A frame waits for its worker for a while that its client can spare, then goes elsewhere; where it
 * went, the next one goes. */
static void test_patience(void)
{
    struct homes *h = homes_create();
    uint64_t now = 1000 * CLOCK_S;
    struct render a = frame(1, "a", now), hurried = a;
    hurried.last_deadline_ns = now + 400 * MS;
    homes_take(h, &a, 1, now);
    CHECK(homes_is_away(h, &hurried, 0, now + 50 * MS));
    CHECK(!homes_is_away(h, &hurried, 0, now + 100 * MS));
    CHECK(homes_is_away(h, &a, 0, now + 100 * MS));
    CHECK(!homes_is_away(h, &a, 0, now + 1000 * MS));
    homes_take(h, &a, 0, now + 1000 * MS);
    struct render next = frame(1, "a", now + 1000 * MS);
    CHECK(homes_is_away(h, &next, 1, now + 1000 * MS) && !homes_is_away(h, &next, 0, now));
    /* What the worker has forgotten is waited for by nobody. */
    next = frame(1, "a", now + 100 * CLOCK_S);
    CHECK(!homes_is_away(h, &next, 1, now + 100 * CLOCK_S));
    homes_destroy(h);
}

/* The table is bounded; the oldest leave. */
static void test_many(void)
{
    struct homes *h = homes_create();
    uint64_t now = 1000 * CLOCK_S;
    char name[16];
    for (uint32_t i = 0; i < 3 * HOMES_MOST; i++) {
        snprintf(name, sizeof name, "%u", i);
        struct render render = frame(1, name, now);
        homes_take(h, &render, 1, now + i);
    }
    CHECK(homes_count(h) == HOMES_MOST);
    struct render first = frame(1, "0", now), last = frame(1, name, now);
    CHECK(!homes_is_away(h, &first, 0, now));
    CHECK(homes_is_away(h, &last, 0, now));
    homes_destroy(h);
}

int main(void)
{
    test_stays();
    test_patience();
    test_many();
    CHECK_DONE();
}
