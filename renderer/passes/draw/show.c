#include "renderer/passes/draw/show.h"

enum technique_step pass_step(struct technique_run *run, uint32_t done, uint32_t total)
{
    return run->watch ? run->watch->step(run, done, total) : STEP_GO_ON;
}

bool pass_show(struct technique_run *run, struct pen_error *error)
{
    return run->watch->show(run, error);
}
