/* A method that takes its samples one batch after the other says after each how far it is. In
 * straight-line code, with `settle` for what turns its sums into vis:
 *
 *     for (each batch) {
 *         add it;
 *         enum technique_step step = pass_step(run, done, total);
 *         if (step == STEP_STOP)
 *             break;
 *         if (step == STEP_SHOW && !(settle(run) && pass_show(run, error)))
 *             return false;
 *     }
 *     return settle(run);
 *
 * What settle writes must depend on the sums alone, which it leaves as they are. Costs nothing while
 * nobody watches. The first `done` should be few samples: what comes first is a picture, too. */
#pragma once
#include "renderer/technique.h"

enum technique_step pass_step(struct technique_run *run, uint32_t done, uint32_t total);
/* Only after STEP_SHOW, vis filled for all of the face's receivers. False as pass_turn. */
bool pass_show(struct technique_run *run, struct pen_error *error);
