/* How many requests each client has under way. */
#pragma once
#include <stdint.h>

struct shares;
struct shares *shares_create(void);
void shares_destroy(struct shares *shares);
uint32_t shares_held(const struct shares *shares, uint64_t client);
void shares_use(struct shares *shares, uint64_t client);
void shares_release(struct shares *shares, uint64_t client);
