/* penumbra: the command-line client of the render daemon. */
#include "clients/cli/cli.h"
#include <curl/curl.h>
#include <signal.h>
#include <string.h>

static const char help_text[] =
    "penumbra render SCENE -o FILE    renders a scene with soft shadows\n"
    "penumbra compare SCENE           measures shadow methods against a reference\n"
    "penumbra sequence SCENE -o OUT   renders many views of a scene: a turntable, keyframes ...\n"
    "penumbra jobs                    lists, shows, waits for and cancels jobs of the server\n"
    "penumbra scenes                  lists, shows, uploads and deletes scenes\n"
    "penumbra techniques [NAME]       lists the shadow methods, or explains one\n"
    "penumbra generate KIND -o FILE   makes a demo or test scene\n"
    "penumbra version\n"
    "\n"
    "penumbra COMMAND --help says more. The server is --server URL, $PENUMBRA_SERVER or\n"
    "http://127.0.0.1:8080; $PENUMBRA_TOKEN is sent as a bearer token.\n"
    "\n"
    "Exit status: 0 done, 1 a file cannot be read or written, 2 wrong usage, 3 the server refuses\n"
    "(4xx), 4 the server failed or is busy (5xx), 5 no connection.\n";

static int version(struct cli_args *args)
{
    if (args->at < args->count)
        return cli_unknown(args, "version");
    puts("penumbra " PENUMBRA_VERSION);
    return CLI_OK;
}

int main(int argc, char **argv)
{
    static const struct {
        const char *name;
        int (*run)(struct cli_args *);
    } commands[] = {{"render", cli_render}, {"compare", cli_compare}, {"sequence", cli_sequence},
        {"jobs", cli_jobs}, {"scenes", cli_scenes}, {"techniques", cli_techniques},
        {"generate", cli_generate}, {"version", version}, {"--version", version}};
    const char *name = argc > 1 ? argv[1] : "";
    struct cli_args args = {argv, argc, 2, CLI_OK};
    if (!strcmp(name, "help") || !strcmp(name, "--help") || !strcmp(name, "-h")) {
        fputs(help_text, stdout);
        return CLI_OK;
    }
    signal(SIGPIPE, SIG_IGN); /* a reader that leaves shows as a failed write */
    curl_global_init(CURL_GLOBAL_DEFAULT);
    for (size_t i = 0; i < sizeof commands / sizeof *commands; i++) {
        if (strcmp(name, commands[i].name))
            continue;
        int status = commands[i].run(&args);
        curl_global_cleanup();
        if (fflush(stdout) && status == CLI_OK)
            status = cli_fail(CLI_FAILED, "Standard output cannot be written.");
        return status;
    }
    curl_global_cleanup();
    if (*name)
        cli_fail(CLI_USAGE, "There is no command %s.", name);
    fputs(help_text, stderr);
    return CLI_USAGE;
}
