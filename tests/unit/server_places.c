/* Places for uploads: one client does not get them all. */
#include "server/uploads/places.h"
#include "tests/unit/check.h"

int main(void)
{
    for (uint32_t most = 2; most <= 32; most *= 2) {
        struct places *p = places_create(most);
        struct pen_error error = {0};
        uint32_t his = 0, hers = 0;
        while (places_take(p, 1, &error))
            his++;
        CHECK(his == most - most / 4 && (his == most || error.code == PEN_TOO_MANY));
        error = (struct pen_error){0};
        while (places_take(p, 2, &error))
            hers++;
        CHECK(his + hers == most && error.code == PEN_UNAVAILABLE);
        if (hers) {
            places_leave(p, 2);
            CHECK(!places_take(p, 1, &error) && places_take(p, 3, &error));
            places_leave(p, 3);
            hers--;
        }
        while (his--)
            places_leave(p, 1);
        while (hers--)
            places_leave(p, 2);
        CHECK(places_take(p, 1, &error));
        places_destroy(p);
    }
    places_destroy(NULL);
    CHECK_DONE();
}
