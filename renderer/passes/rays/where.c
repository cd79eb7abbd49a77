#include "renderer/passes/rays/where.h"

bool pass_rays(struct technique_run *run, uint32_t backend, const struct ray_job *job,
    struct ray_targets *targets, bool *settled, struct pen_error *error)
{
    struct pen_error refused = {0};
    *settled = false;
#ifdef PENUMBRA_HAVE_TRACE
    bool on_host = backend == RAYS_ON_CPU || (backend == RAYS_AUTO && run->ctx->software);
    if (!on_host && pass_rays_device(run, job, targets, &refused))
        return true;
    if (!on_host && backend == RAYS_AUTO && refused.code == PEN_TOO_BIG) {
        on_host = true; /* the only way back from the GPU */
        pen_result_warn(run->result, "Rays were traced on the CPU. %s", refused.message);
    }
    if (on_host) {
        *settled = ray_host_settles(run, job);
        return pass_rays_host(run, job, targets, error);
    }
#else
    (void)backend;
    if (pass_rays_device(run, job, targets, &refused))
        return true;
#endif
    return pen_fail(error, refused.code, refused.pointer, "%s", refused.message);
}
