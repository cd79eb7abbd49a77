/* Allocation that cannot fail. What asks here wants a size that our own code bounds: a program that
 * cannot have so little ends, and what started it starts another. A size that a client names (a
 * picture, a scene) is asked for with malloc where it is refused politely.
 *
 * Never NULL, also for nothing; count x item_bytes does not overflow unnoticed. Freed with free. */
#pragma once
#include <stddef.h>

void *pen_alloc(size_t count, size_t item_bytes); /* not cleared */
void *pen_alloc_zero(size_t count, size_t item_bytes);
void *pen_realloc_array(void *memory, size_t count, size_t item_bytes);

/* How the program ends when there is no memory: with this status; 0, as it begins: by abort. Before it has
 * threads. */
void pen_memory_exit(int status);

/* An array that holds *capacity items with room for `count`: when it grows, at least twofold. */
void *pen_grow(void *memory, size_t *capacity, size_t count, size_t item_bytes);
