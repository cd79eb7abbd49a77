/* Addresses that name their entry by the first digits of its id. */
#include "server/routes/routes.h"
#include <stdio.h>
#include <string.h>

#define CANDIDATES 5 /* that are named */

typedef uint8_t entry_id[PEN_ID_BYTES];

static uint32_t common_digits(const char *a, const char *b)
{
    uint32_t digits = 0;
    while (a[digits] && a[digits] == b[digits])
        digits++;
    return digits;
}

/* The id before (step 0xff) or behind (step 1) it; false at either end. */
static bool neighbour(entry_id id, uint8_t step)
{
    for (int i = PEN_ID_BYTES - 1; i >= 0; i--) {
        id[i] = (uint8_t)(id[i] + step);
        if (id[i] != (step == 1 ? 0 : 0xff))
            return true;
    }
    return false;
}

/* Stored entries from the first digits on, at most `most`. */
static uint32_t find_stored(
    struct call *call, enum store_kind kind, entry_id ids[CANDIDATES + 1], uint32_t most)
{
    struct store_entry entries[CANDIDATES + 1];
    entry_id before;
    memcpy(before, call->address.id, sizeof before);
    uint32_t count = scene_store_list(
        call->service->store, kind, neighbour(before, 0xff) ? before : NULL, entries, most);
    for (uint32_t i = 0; i < count; i++)
        memcpy(ids[i], entries[i].id, sizeof ids[i]);
    return count;
}

/* The caller's jobs from the last that could have these digits downwards. */
static bool find_jobs(struct call *call, entry_id ids[CANDIDATES + 1], uint32_t most,
    uint32_t *count, struct pen_error *error)
{
    struct job_store *store = jobs_store(call->service->jobs, error);
    struct job jobs[CANDIDATES + 1];
    entry_id behind;
    memcpy(behind, call->address.id, sizeof behind);
    for (uint32_t digit = call->address.id_digits; digit < PEN_ID_HEX; digit++)
        behind[digit / 2] |= digit % 2 ? 0x0f : 0xf0;
    bool mine = call->service->auth && !(call->grant.scopes & AUTH_ADMIN);
    struct job_page page = {.client = mine ? call_owner(call) : 0,
        .state = JOB_STATES,
        .before = neighbour(behind, 1) ? behind : NULL,
        .jobs = jobs,
        .most = most};
    if (!store || !job_store_list(store, &page, error))
        return false;
    for (uint32_t i = 0; i < page.count; i++)
        memcpy(ids[i], jobs[i].id, sizeof ids[i]);
    *count = page.count;
    return true;
}

static bool refuse(char hex[][PEN_ID_HEX + 1], uint32_t count, uint32_t digits, const char *word,
    struct pen_error *error)
{
    char list[CANDIDATES * (PEN_ID_HEX + 2) + 8] = "";
    uint32_t shown = digits;
    for (uint32_t i = 1; i < count; i++) /* they are in order */
        shown =
            common_digits(hex[i - 1], hex[i]) > shown ? common_digits(hex[i - 1], hex[i]) : shown;
    shown = shown + 1 < PEN_ID_HEX ? shown + 1 : PEN_ID_HEX;
    for (uint32_t i = 0; i < count && i < CANDIDATES; i++)
        snprintf(list + strlen(list), sizeof list - strlen(list), "%s%.*s", i ? ", " : "",
            (int)shown, hex[i]);
    return pen_fail(error, PEN_AMBIGUOUS, "", "\"%.*s\" begins the ids of several %ss: %s%s.",
        (int)digits, hex[0], word, list, count > CANDIDATES ? ", ..." : "");
}

bool routes_resolve(struct call *call, struct pen_error *error)
{
    struct pen_route_match *address = &call->address;
    const char *pattern = address->route->pattern;
    entry_id ids[CANDIDATES + 1];
    char given[PEN_ID_HEX + 1], hex[CANDIDATES + 1][PEN_ID_HEX + 1];
    uint32_t digits = address->id_digits, count = 0, fitting = 0;
    if (!strstr(pattern, "{id}") || digits == PEN_ID_HEX)
        return true;
    bool jobs = !strncmp(pattern, "/v1/jobs/", 9), scenes = !strncmp(pattern, "/v1/scenes/", 11);
    const char *word = jobs ? "job" : scenes ? "scene" : "image";
    if (!jobs && !scenes && strncmp(pattern, "/v1/images/", 11))
        return pen_fail(error, PEN_NOT_FOUND, "", "There is nothing at this address.");
    if (!strcmp(address->route->method, "PUT"))
        return pen_fail(error, PEN_INVALID, "",
            "A %s is put under its whole id, %d hexadecimal digits.", word, PEN_ID_HEX);
    if (!jobs)
        count = find_stored(call, scenes ? STORE_SCENES : STORE_IMAGES, ids, CANDIDATES + 1);
    else if (!find_jobs(call, ids, CANDIDATES + 1, &count, error))
        return false;
    pen_id_to_hex(address->id, given);
    for (uint32_t i = 0; i < count; i++) {
        pen_id_to_hex(ids[i], hex[fitting]);
        if (common_digits(hex[fitting], given) < digits)
            break;
        fitting++;
    }
    if (!fitting)
        return pen_fail(error, PEN_NOT_FOUND, "", "There is no such %s.", word);
    if (fitting > 1)
        return refuse(hex, fitting, digits, word, error);
    memcpy(address->id, ids[0], sizeof ids[0]);
    address->id_digits = PEN_ID_HEX;
    return true;
}
