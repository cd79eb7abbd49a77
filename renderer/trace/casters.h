/* Which primitives cast shadows, told from what their alpha can be. No GL, no Embree. */
#pragma once
#include "renderer/blob/pscene.h"

enum trace_caster {
    TRACE_CASTS,          /* wherever it is hit */
    TRACE_CASTS_BY_ALPHA, /* where texture and vertex alpha say so */
    TRACE_CASTS_NOTHING,
};

/* enum trace_caster of every primitive; the caller frees it. NULL when memory is short. */
uint8_t *trace_casters(const struct psc_scene *scene);
