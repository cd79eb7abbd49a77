/* How much of the renderer each client has had lately: who has had least comes first. Interactive
 * renders and batches of one client are two accounts; a batch's time counts more often. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#define ACCOUNTS_BATCH_COST 8.0

struct account {
    struct account *next;
    uint64_t client;
    uint64_t last_ns;
    double used_ms;
    double new_ms;     /* that it will be taken for a newcomer yet */
    double backlog_ms; /* for the scheduler to count with */
    uint32_t present;  /* renders that wait or are made */
    bool batch;
};

struct accounts;
struct accounts *accounts_create(void);
void accounts_destroy(struct accounts *accounts);

/* A render of the client's is there: the account stays until as many accounts_leave. One who comes
 * back after a time away has at most a little in hand over those who were there all along; so has
 * one who is new, unless very many are. */
struct account *accounts_enter(
    struct accounts *accounts, uint64_t client, bool batch, uint64_t now_ns);
/* Accounts without renders are kept for a while, a bounded number of them. */
void accounts_leave(struct accounts *accounts, struct account *account, uint64_t now_ns);
/* `ms` of the renderer went to it; negative: that was too much. */
void accounts_charge(struct accounts *accounts, struct account *account, double ms);
/* The accounts that have renders, and some that have none. */
struct account *accounts_first(const struct accounts *accounts);
