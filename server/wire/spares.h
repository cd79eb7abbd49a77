/* Descriptors that are held for when the process has no more. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#define SPARES_MAX 16

struct spares {
    int fd[SPARES_MAX]; /* -1: given away */
    uint32_t count;
};

void spares_init(struct spares *spares, uint32_t count);
void spares_finish(struct spares *spares);
/* Takes again what was given away, as far as there are descriptors. */
void spares_fill(struct spares *spares);
/* Gives up to `count` to whoever asks for descriptors next. */
void spares_give(struct spares *spares, uint32_t count);
/* errno says that there was none (or no memory for it). */
bool spares_are_needed(void);
/* How many this process may have. */
int spares_limit(void);
