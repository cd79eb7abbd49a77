#include "server/queue/estimates.h"
#include "protocol/fnv.h"
#include "protocol/memory.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define ENTRIES 512
/* What a frame costs beside its pixels (maps, geometry), as if it were pixels. */
#define FRAME_PIXELS 50000.0
/* Weight of what was seen last, and one that is further off than so many times counts as so far off.
 * Too high an estimate refuses what could be made: it falls faster than it rises. */
#define RISE 0.3
#define FALL 0.5
#define MOST_RISE 4.0
#define MOST_FALL 8.0
#define HALF_LIFE_MS 6e4 /* of the sureness of what was not seen again */
/* The least that was seen falls at once and rises little with each that took longer. */
#define LEAST_RISE 1.1
#define DOUBT_MS 1e4 /* between two that are let in to see */

enum level { LEVEL_SAME, LEVEL_SETTINGS, LEVEL_METHOD, LEVELS };
static const double sureness[LEVELS] = {0.6, 0.4, 0.2};

struct entry {
    uint64_t key; /* 0: unused */
    uint64_t seen_ns;
    double rate; /* ms per unit of work */
    double least;
    uint64_t doubted_ns; /* when one was refused first, or let in to see; 0: never */
};

struct estimates {
    const struct pen_catalogue *catalogue;
    struct entry entries[ENTRIES];
};

struct estimates *estimates_create(const struct pen_catalogue *catalogue)
{
    struct estimates *e = pen_alloc_zero(1, sizeof *e);
    e->catalogue = catalogue;
    return e;
}

void estimates_destroy(struct estimates *e)
{
    free(e);
}

static double samples_of(const struct estimates *e, const struct pen_request *r)
{
    const struct pen_technique_info *info =
        e->catalogue ? pen_catalogue_find(e->catalogue, r->technique) : NULL;
    const struct pen_param *row = info ? pen_param_find(info->params, "samples") : NULL;
    return row ? fmax(1, pen_param_load(row, r->technique_params, 0)) : 1;
}

static double work_of(const struct estimates *e, const struct pen_request *r, enum level level)
{
    double work = r->antialias * ((double)r->width * r->height + FRAME_PIXELS);
    return level == LEVEL_METHOD ? work * samples_of(e, r) : work;
}

static uint64_t key_of(const struct pen_request *r, enum level level)
{
    const uint32_t kind[] = {level, level == LEVEL_SAME ? r->light_count : 0,
        level == LEVEL_METHOD ? 0 : r->output.layer};
    uint64_t key = pen_fnv(PEN_FNV_START, kind, sizeof kind);
    key = pen_fnv(key, r->technique, strlen(r->technique));
    if (level != LEVEL_METHOD)
        key = pen_fnv(key, r->technique_params, sizeof r->technique_params);
    if (level == LEVEL_SAME)
        key = pen_fnv(key, r->scene, sizeof r->scene);
    return key ? key : 1;
}

static const struct entry *find(const struct estimates *e, uint64_t key)
{
    for (uint32_t i = 0; i < ENTRIES; i++)
        if (e->entries[i].key == key)
            return &e->entries[i];
    return NULL;
}

static double ms_between(uint64_t from_ns, uint64_t to_ns)
{
    return to_ns > from_ns ? (double)(to_ns - from_ns) / 1e6 : 0;
}

struct estimate estimates_of(
    const struct estimates *e, const struct pen_request *r, uint64_t now_ns)
{
    for (int level = 0; level < LEVELS; level++) {
        const struct entry *entry = find(e, key_of(r, level));
        if (!entry)
            continue;
        double work = work_of(e, r, level);
        return (struct estimate){.ms = entry->rate * work,
            .sure = sureness[level] * exp2(-ms_between(entry->seen_ns, now_ns) / HALF_LIFE_MS),
            .least_ms = level == LEVEL_SAME ? entry->least * work : 0};
    }
    return (struct estimate){-1, 0, 0};
}

bool estimates_doubt(struct estimates *e, const struct pen_request *r, uint64_t now_ns)
{
    for (int level = 0; level < LEVELS; level++) {
        struct entry *entry = (struct entry *)find(e, key_of(r, level));
        if (!entry)
            continue;
        bool due = entry->doubted_ns && ms_between(entry->doubted_ns, now_ns) > DOUBT_MS;
        if (due || !entry->doubted_ns)
            entry->doubted_ns = now_ns;
        return due;
    }
    return false;
}

/* The entry of that key, or in place of the one not seen for longest. */
static struct entry *entry_for(struct estimates *e, uint64_t key)
{
    struct entry *oldest = &e->entries[0];
    for (uint32_t i = 0; i < ENTRIES; i++) {
        if (e->entries[i].key == key)
            return &e->entries[i];
        if (e->entries[i].seen_ns < oldest->seen_ns)
            oldest = &e->entries[i];
    }
    *oldest = (struct entry){.key = key};
    return oldest;
}

void estimates_learn(
    struct estimates *e, const struct pen_request *r, double ms, bool whole, uint64_t now_ns)
{
    if (!(ms > 0))
        return;
    for (int level = 0; level < LEVELS; level++) {
        double rate = ms / work_of(e, r, level);
        uint64_t key = key_of(r, level);
        const struct entry *known = find(e, key);
        /* One that was given up says only that it would have taken longer. */
        if (!whole && (!known || known->rate >= rate))
            continue;
        struct entry *entry = entry_for(e, key);
        double old = entry->rate;
        entry->least = old > 0 ? fmin(rate, LEAST_RISE * entry->least) : rate;
        rate = old > 0 ? fmin(fmax(rate, old / MOST_FALL), old * MOST_RISE) : rate;
        entry->rate = old > 0 ? old + (rate < old ? FALL : RISE) * (rate - old) : rate;
        entry->seen_ns = now_ns;
    }
}

uint32_t estimates_count(const struct estimates *e)
{
    uint32_t count = 0;
    for (uint32_t i = 0; i < ENTRIES; i++)
        count += e->entries[i].key != 0;
    return count;
}
