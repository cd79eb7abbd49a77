/* What to measure: one step per line, fields separated by tabs.
 *
 *   scene    NAME  generated  KIND  TRIANGLES
 *   scene    NAME  file  PATH.pscene
 *   group    NAME  SCENE  REPETITIONS  SECONDS  FLAGS  SETTINGS   settings all variants share
 *   variant  NAME  SETTINGS            the first that is called "reference" is what others are
 *                                      compared with; it is rendered once and not timed
 *   compare  NAME  WITH                one more comparison of two variants
 *   run                                measures the group
 *
 * SETTINGS: key=value joined by "&", as in a query string (pen_request_from_query); FLAGS: letters,
 * or "-": f computes FLIP, k also times with kept shadow inputs, p writes pictures, v pictures of the
 * visibility instead of the beauty. */
#pragma once
#include "protocol/request.h"
#include <stdio.h>

#define PLAN_VARIANTS 48
#define PLAN_PAIRS 48

struct plan_scene {
    char name[64];
    uint8_t id[PEN_ID_BYTES];
    uint32_t kind, triangles; /* generated */
    char path[512];           /* empty: generated */
    int fd;                   /* -1: not opened yet */
};

enum { VARIANT_OK, VARIANT_MISSING, VARIANT_FAILED };

struct plan_variant {
    char name[64];
    char settings[512];
    uint32_t status;
    struct pen_error error;
    struct pen_request request; /* valid when status is VARIANT_OK */
};

struct plan_group {
    char name[64], flags[16], settings[512];
    struct plan_scene *scene;
    uint32_t repetitions;
    double seconds; /* repetitions stop after so long, but there are at least two, and once they
                       agree closely */
    uint32_t variant_count, pair_count;
    struct plan_variant variants[PLAN_VARIANTS];
    uint32_t pairs[PLAN_PAIRS][2];
};

/* Reads up to and including the next "run"; false at the end. A malformed plan ends the program. */
bool plan_next(FILE *file, struct plan_group *group);
/* The blob of the scene, made or opened at first use. Exits when it cannot be had. */
int plan_scene_open(struct plan_scene *scene);
