#include "server/workers/measured.h"
#include <sys/stat.h>

static struct picture *take_picture(int fd, struct outcome *outcome)
{
    struct pen_result own = *outcome->result;
    struct stat status;
    own.image_bytes = fstat(fd, &status) ? 0 : (uint64_t)status.st_size;
    own.completed.output = (struct pen_output){.format = PEN_PNG, .bit_depth = 8};
    return picture_create(fd, &own, NULL, &outcome->error);
}

void measured_take(uint32_t measure, const struct channel_fds *fds, struct outcome *outcome)
{
    static const uint32_t counts[] = {
        [MEASURE_REFERENCE] = 2, [MEASURE_COMPARED] = 1 + MEASURE_MAPS, [MEASURE_NUMBERS] = 0};
    if (fds->count != counts[measure]) {
        pen_fail(&outcome->error, PEN_INTERNAL, "", "The worker handed over half a measurement.");
        return;
    }
    if (fds->count)
        outcome->picture = take_picture(fds->fd[0], outcome);
    if (measure == MEASURE_REFERENCE)
        outcome->planes_fd = fds->fd[1];
    for (int m = 0; measure == MEASURE_COMPARED && m < MEASURE_MAPS; m++)
        outcome->maps[m] = take_picture(fds->fd[1 + m], outcome);
}

void measured_release(struct outcome *outcome)
{
    picture_release(outcome->picture);
    for (int m = 0; m < MEASURE_MAPS; m++)
        picture_release(outcome->maps[m]);
}
