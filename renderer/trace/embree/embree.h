/* Embree 3 or 4, whichever CMake has found: what differs between them, under names of ours. */
#pragma once
#include <stdbool.h>
#if PENUMBRA_EMBREE >= 4
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#if PENUMBRA_EMBREE >= 4

/* What filters get to see of a query. */
typedef struct RTCRayQueryContext embree_context;

static inline void embree_context_init(embree_context *context)
{
    rtcInitRayQueryContext(context);
}

/* Sixteen rays to what they hit first; coherent: from one eye. */
static inline void embree_intersect16(const int *valid, RTCScene scene, embree_context *context,
    struct RTCRayHit16 *rays, bool coherent)
{
    struct RTCIntersectArguments arguments;
    rtcInitIntersectArguments(&arguments);
    arguments.flags = coherent ? RTC_RAY_QUERY_FLAG_COHERENT : RTC_RAY_QUERY_FLAG_INCOHERENT;
    arguments.context = context;
    rtcIntersect16(valid, scene, rays, &arguments);
}

/* Sixteen shadow rays in whatever directions. */
static inline void embree_occluded16(
    const int *valid, RTCScene scene, embree_context *context, struct RTCRay16 *rays)
{
    struct RTCOccludedArguments arguments;
    rtcInitOccludedArguments(&arguments);
    arguments.flags = RTC_RAY_QUERY_FLAG_INCOHERENT;
    arguments.context = context;
    rtcOccluded16(valid, scene, rays, &arguments);
}

#else

typedef struct RTCIntersectContext embree_context;

static inline void embree_context_init(embree_context *context)
{
    rtcInitIntersectContext(context);
}

static inline void embree_intersect16(const int *valid, RTCScene scene, embree_context *context,
    struct RTCRayHit16 *rays, bool coherent)
{
    context->flags =
        coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
    rtcIntersect16(valid, scene, context, rays);
}

static inline void embree_occluded16(
    const int *valid, RTCScene scene, embree_context *context, struct RTCRay16 *rays)
{
    context->flags = RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
    rtcOccluded16(valid, scene, context, rays);
}

#endif
