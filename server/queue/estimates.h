/* What renders cost here, learned from those that were made: time on the renderer per unit of work,
 * for the same method and settings on the same scene, and more coarsely for the method alone. */
#pragma once
#include "protocol/request.h"
#include "protocol/technique_info.h"

struct estimates;
/* The catalogue stays; NULL: methods have no sample counts. */
struct estimates *estimates_create(const struct pen_catalogue *catalogue);
void estimates_destroy(struct estimates *estimates);

struct estimate {
    double ms;   /* < 0: nothing like it was made yet */
    double sure; /* 0 to 1: how much of it may be held against somebody; falls as it grows old */
    double least_ms; /* by the cheapest like it on the same scene; 0: none was made there */
};
struct estimate estimates_of(
    const struct estimates *estimates, const struct pen_request *request, uint64_t now_ns);
/* One was made in `ms` of the renderer's time; or, not `whole`, given up after so much. */
void estimates_learn(struct estimates *estimates, const struct pen_request *request, double ms,
    bool whole, uint64_t now_ns);
/* One like this is refused for what is known of it. True: it is let in all the same, now and then, to
 * see whether that still holds; whoever wants others refused could make them look dear. */
bool estimates_doubt(
    struct estimates *estimates, const struct pen_request *request, uint64_t now_ns);
uint32_t estimates_count(const struct estimates *estimates);
