#include "clients/cli/jobs.h"
#include "clients/cli/listing.h"
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define FIRST_PAUSE_US 50000
#define MOST_PAUSE_US 1000000

static const char help_text[] =
    "penumbra jobs [list [--json]]   lists the jobs, from the newest on\n"
    "penumbra jobs show ID           how far a job is, as JSON\n"
    "penumbra jobs wait ID           waits until it is over, and shows it\n"
    "penumbra jobs cancel ID         ends a job, or removes one that is over with its files\n"
    "\n"
    "  --server URL   default: $PENUMBRA_SERVER or http://127.0.0.1:8080\n"
    "  --retry N      how often a busy server is asked again (4)\n"
    "  -v             prints calls and times\n";

static void print_job(const cJSON *job)
{
    const cJSON *frames = cJSON_GetObjectItemCaseSensitive(job, "frames");
    printf("%s %-8s %-10s %6.0f of %6.0f frames %8.1f MB\n", cli_text(job, "id"),
        cli_text(job, "kind"), cli_text(job, "state"), cli_number(frames, "done"),
        cli_number(frames, "total"), cli_number(job, "bytes") / 1e6);
}

static void tell(const cJSON *job)
{
    const cJSON *frames = cJSON_GetObjectItemCaseSensitive(job, "frames");
    if (isatty(STDERR_FILENO))
        fprintf(stderr, "\r%s: %.0f of %.0f frames ", cli_text(job, "state"),
            cli_number(frames, "done"), cli_number(frames, "total"));
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
    const char *state;
    for (;;) {
        int status = get(server, path, job);
        if (status != CLI_OK)
            return status;
        tell(*job);
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

int cli_jobs(struct cli_args *args)
{
    struct cli_server server;
    const char *words[2] = {"list", NULL};
    bool json = false;
    if (!cli_words(args, &(struct cli_words){"jobs", help_text, words, 2, &server, &json}))
        return args->status;
    if (!strcmp(words[0], "list") && !words[1])
        return cli_list(&server, "/v1/jobs", "jobs", json, print_job);
    if (!strcmp(words[0], "show") && words[1])
        return cli_with_id(&server, "GET", "/v1/jobs", words[1]);
    if (!strcmp(words[0], "cancel") && words[1])
        return cli_with_id(&server, "DELETE", "/v1/jobs", words[1]);
    if (!strcmp(words[0], "wait") && words[1])
        return wait_for(&server, words[1]);
    return cli_fail(CLI_USAGE, "See penumbra jobs --help.");
}
