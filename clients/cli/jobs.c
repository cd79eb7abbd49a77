#include "clients/cli/jobs.h"
#include "clients/cli/listing.h"
#include "clients/cli/rows/command.h"
#include "clients/cli/rows/parse.h"
#include "clients/cli/which.h"
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#define BAR 30 /* characters */
#define FIRST_PAUSE_US 50000
#define MOST_PAUSE_US 1000000

static void print_job(const cJSON *job)
{
    const cJSON *frames = cJSON_GetObjectItemCaseSensitive(job, "frames");
    printf("%s %-8s %-10s %6.0f of %6.0f frames %8.1f MB\n", cli_text(job, "id"),
        cli_text(job, "kind"), cli_text(job, "state"), cli_number(frames, "done"),
        cli_number(frames, "total"), cli_number(job, "bytes") / 1e6);
}

/* "running [#####.....]  12 of 36 frames, 0:07 left", on a terminal. */
static void tell(const cJSON *job, double elapsed_s)
{
    char bar[BAR + 1];
    const cJSON *frames = cJSON_GetObjectItemCaseSensitive(job, "frames");
    double done = cli_number(frames, "done"), total = cli_number(frames, "total");
    double share = total > 0 ? done / total : 0;
    if (!isatty(STDERR_FILENO))
        return;
    for (int i = 0; i < BAR; i++)
        bar[i] = i < (int)(share * BAR + 0.5) ? '#' : '.';
    bar[BAR] = 0;
    fprintf(stderr, "\r%s [%s] %.0f of %.0f frames", cli_text(job, "state"), bar, done, total);
    int left_s = done > 0 ? (int)(elapsed_s * (total - done) / done + 0.5) : 0;
    if (done > 0 && done < total)
        fprintf(stderr, ", %d:%02d left", left_s / 60, left_s % 60);
    fputs("\033[K", stderr);
}

static int get(const struct cli_server *server, const char *path, cJSON **job)
{
    struct cli_answer answer;
    struct cli_call call = {.method = "GET", .path = path};
    int status = cli_call(server, &call, &answer);
    *job = status == CLI_OK ? cli_answer_object(&answer) : NULL;
    cli_answer_finish(&answer);
    return status == CLI_OK && !*job ? CLI_SERVER : status;
}

int cli_wait_job(const struct cli_server *server, const char *path, cJSON **job)
{
    unsigned pause_us = FIRST_PAUSE_US;
    struct timespec start, now;
    clock_gettime(CLOCK_MONOTONIC, &start);
    const char *state;
    for (;;) {
        int status = get(server, path, job);
        if (status != CLI_OK)
            return status;
        clock_gettime(CLOCK_MONOTONIC, &now);
        tell(*job,
            (double)(now.tv_sec - start.tv_sec) + 1e-9 * (double)(now.tv_nsec - start.tv_nsec));
        state = cli_text(*job, "state");
        if (strcmp(state, "accepted") && strcmp(state, "running"))
            break;
        cJSON_Delete(*job);
        usleep(pause_us);
        pause_us = pause_us * 2 < MOST_PAUSE_US ? pause_us * 2 : MOST_PAUSE_US;
    }
    if (isatty(STDERR_FILENO))
        fputc('\n', stderr);
    if (!strcmp(state, "successful"))
        return CLI_OK;
    if (!strcmp(state, "dismissed"))
        return cli_fail(CLI_FAILED, "The job was cancelled.");
    return cli_fail(CLI_SERVER, "The job failed: %s",
        cli_text(cJSON_GetObjectItemCaseSensitive(*job, "error"), "detail"));
}

static int wait_for(const struct cli_server *server, const char *id)
{
    cJSON *job = NULL;
    char *path = cli_format("/v1/jobs/%s", id);
    int status = cli_wait_job(server, path, &job);
    if (job)
        print_job(job);
    cJSON_Delete(job);
    free(path);
    return status;
}

struct options {
    struct cli_common common;
    bool json;
};

static int run(const struct cli_command *command, struct cli_args *args)
{
    struct options options = {0};
    int status = cli_parse(command, args, &options, NULL);
    if (status != CLI_OK || options.common.help)
        return status;
    const struct cli_server *server = &options.common.server;
    const char *word = options.common.count ? options.common.words[0] : "list";
    const char *id = options.common.words[1];
    if (!strcmp(word, "list") && !id)
        return cli_list(server, "/v1/jobs", "jobs", options.json, print_job);
    bool show = !strcmp(word, "show"), cancel = !strcmp(word, "cancel"),
         wait = !strcmp(word, "wait");
    if (!id || !(show || cancel || wait))
        return cli_fail(CLI_USAGE, "See penumbra jobs --help.");
    if (!cli_is_prefix(id))
        return cli_fail(CLI_USAGE, "%s is no id of a job, nor at least %d of its first digits.", id,
            PEN_ID_PREFIX);
    return wait ? wait_for(server, id)
                : cli_with_id(server, show ? "GET" : "DELETE", "/v1/jobs", id);
}

const struct cli_command cli_jobs = {.name = "jobs",
    .summary = "lists, shows, waits for and cancels jobs of the server",
    .words = "",
    .actions = (const struct cli_action[]){{"list", "", "Lists the jobs, from the newest on."},
        {"show", "ID", "How far a job is, as JSON.", CLI_OFFER_JOBS},
        {"wait", "ID", "Waits until it is over, and shows it.", CLI_OFFER_JOBS},
        {"cancel", "ID", "Ends a job, or removes one that is over with its files.", CLI_OFFER_JOBS},
        {0}},
    .about =
        "Jobs of the server: sequences, and what was asked for with Prefer: respond-async. ID is "
        "a job's id, or as many of its first digits as no other job has. Without a word it "
        "lists.",
    .rows =
        (const struct cli_row[]){
            {"json", NULL, "Lists as JSON.", .offset = offsetof(struct options, json)}, {0}},
    .most_words = 2,
    .run = run};
