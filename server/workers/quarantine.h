/* What ended workers: requests of one scene, method and size, and, when several of them did, the
 * scene. */
#pragma once
#include "protocol/request.h"

struct quarantine;
struct quarantine *quarantine_create(uint64_t seconds);
void quarantine_destroy(struct quarantine *quarantine);

enum quarantined { QUARANTINE_NOTHING, QUARANTINE_REQUEST, QUARANTINE_SCENE };
/* The request ended a worker. What is refused from now on, and was not before. */
enum quarantined quarantine_blame(struct quarantine *quarantine, const struct pen_request *request);
/* Whether it is refused; *remaining_s: for how long still. */
enum quarantined quarantine_check(
    struct quarantine *quarantine, const struct pen_request *request, uint32_t *remaining_s);
/* Scenes that are refused, or of which something is. */
uint32_t quarantine_count(struct quarantine *quarantine);
