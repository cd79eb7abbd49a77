#include "clients/cli/gltf_files.h"
#include "clients/cli/output.h"
#include "clients/cli/render.h"
#include "clients/cli/request_args.h"
#include "clients/cli/rows/command.h"
#include "clients/cli/rows/parse.h"
#include "clients/cli/upload.h"
#include "protocol/memory.h"
#include <poll.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/inotify.h>
#include <time.h>
#include <unistd.h>

#define QUIET_MS 200 /* programs write a file in several steps, and several files */
#define MOST_FOLDERS 64
#define CHANGES (IN_CLOSE_WRITE | IN_MOVED_TO | IN_CREATE | IN_DELETE | IN_MOVED_FROM | IN_ATTRIB)

struct options {
    struct cli_common common;
    const char *output;
};

static const struct cli_row watch_rows[] = {
    {"o", "FILE", "Where the image goes, each time anew; its ending names the format.",
        CLI_OFFER_FILES, .offset = offsetof(struct options, output)},
    {0},
};

/* The files that a scene on disk consists of, and the folders that they lie in: files are replaced,
 * and an editor may put a new one in the place of the old, so it is folders that are watched. */
struct watched {
    int inotify;
    char **files;
    uint32_t count;
    struct {
        int watch;
        char *path;
    } folders[MOST_FOLDERS];
    uint32_t folder_count;
};

static void forget_files(struct watched *w)
{
    for (uint32_t i = 0; i < w->count; i++)
        free(w->files[i]);
    free(w->files);
    w->files = NULL;
    w->count = 0;
}

static void watch_folder(struct watched *w, const char *file)
{
    const char *slash = strrchr(file, '/');
    char *path = slash ? cli_format("%.*s", (int)(slash - file) + 1, file) : cli_format("./");
    int watch = inotify_add_watch(w->inotify, path, CHANGES);
    for (uint32_t i = 0; i < w->folder_count; i++)
        if (w->folders[i].watch == watch || !strcmp(w->folders[i].path, path)) {
            w->folders[i].watch = watch; /* another folder may have this name now */
            free(path);
            return;
        }
    if (watch < 0 || w->folder_count == MOST_FOLDERS) {
        free(path);
        return;
    }
    w->folders[w->folder_count].watch = watch;
    w->folders[w->folder_count++].path = path;
}

/* Before they are read: what happens to them from now on is noticed. */
static void look_at(struct watched *w, const char *scene)
{
    struct cli_files parts = {0};
    const char *entry = strstr(scene, ".zip#");
    size_t bytes = strlen(scene);
    forget_files(w);
    if (bytes > 5 && !strcasecmp(scene + bytes - 5, ".gltf") && !access(scene, R_OK))
        cli_gltf_files(scene, &parts); /* what is wrong with it, it says */
    w->files = pen_alloc_zero(parts.count + 1, sizeof *w->files);
    w->files[w->count++] =
        cli_format("%.*s", (int)(entry ? (size_t)(entry + 4 - scene) : bytes), scene);
    for (uint32_t i = 0; i < parts.count; i++)
        w->files[w->count++] = cli_format("%s", parts.parts[i].path);
    cli_files_finish(&parts);
    for (uint32_t i = 0; i < w->count; i++)
        watch_folder(w, w->files[i]);
}

static bool is_ours(const struct watched *w, const struct inotify_event *event)
{
    if (event->mask & (IN_IGNORED | IN_Q_OVERFLOW))
        return true; /* a folder is gone, or nobody knows what happened */
    for (uint32_t i = 0; i < w->folder_count; i++) {
        if (w->folders[i].watch != event->wd || !event->len)
            continue;
        char *path = cli_format("%s%s", w->folders[i].path, event->name);
        bool ours = false;
        for (uint32_t f = 0; f < w->count; f++) {
            const char *file = w->files[f];
            ours = ours || !strcmp(file, path) || (path[0] == '.' && !strcmp(file, path + 2));
        }
        free(path);
        if (ours)
            return true;
    }
    return false;
}

/* Whether something happened to the files within so many milliseconds; -1: however long it takes. */
static bool changes(struct watched *w, int within_ms)
{
    _Alignas(struct inotify_event) char buffer[1 << 14];
    struct pollfd waits = {.fd = w->inotify, .events = POLLIN};
    while (poll(&waits, 1, within_ms) > 0) {
        bool ours = false;
        ssize_t bytes = read(w->inotify, buffer, sizeof buffer);
        for (char *at = buffer; at < buffer + (bytes > 0 ? bytes : 0);) {
            const struct inotify_event *event = (const struct inotify_event *)at;
            ours = is_ours(w, event) || ours;
            at += sizeof *event + event->len;
        }
        if (ours)
            return true;
    }
    return false;
}

/* Renders the scene as it is now. `id` is that of the version before, "" at first, which is removed
 * when it was this program that brought it. */
static int update(
    const struct options *options, const char *request, char id[PEN_ID_HEX + 1], bool *sent)
{
    const struct cli_server *server = &options->common.server;
    char fresh[PEN_ID_HEX + 1];
    struct cli_stored stored = {0};
    struct timespec begin, end;
    clock_gettime(CLOCK_MONOTONIC, &begin);
    int status = cli_upload_scene(server, options->common.words[0], fresh, &stored);
    cJSON_Delete(stored.description);
    if (status != CLI_OK || !strcmp(fresh, id))
        return status;
    cJSON *root = cJSON_Parse(request);
    status = cli_render_scene(server, fresh, root, false, options->output);
    cJSON_Delete(root);
    clock_gettime(CLOCK_MONOTONIC, &end);
    if (status == CLI_OK)
        fprintf(stderr, "%s: %.0f ms\n", options->output,
            1e3 * (double)(end.tv_sec - begin.tv_sec) +
                1e-6 * (double)(end.tv_nsec - begin.tv_nsec));
    if (*sent) {
        struct cli_answer answer;
        char *path = cli_format("/v1/scenes/%s", id);
        struct cli_call call = {.method = "DELETE", .path = path, .missing_is_ok = true};
        cli_call(server, &call, &answer);
        cli_answer_finish(&answer);
        free(path);
    }
    memcpy(id, fresh, sizeof fresh);
    *sent = stored.sent;
    return status;
}

static int watch(const struct options *options, const char *request)
{
    struct watched w = {.inotify = inotify_init1(IN_CLOEXEC)};
    const char *scene = options->common.words[0];
    char id[PEN_ID_HEX + 1] = "";
    bool sent = false;
    if (w.inotify < 0)
        return cli_fail(CLI_FAILED, "Files cannot be watched here.");
    look_at(&w, scene);
    if (access(w.files[0], R_OK))
        return cli_output_fail(w.files[0], "read");
    int status = update(options, request, id, &sent);
    /* What cannot be drawn now may be mended; a server that is not there, or refuses, may not. */
    while (status != CLI_NO_CONNECTION || *id) {
        if (!changes(&w, -1))
            continue;
        while (changes(&w, QUIET_MS)) {
        }
        look_at(&w, scene);
        if (!access(w.files[0], R_OK)) /* else it comes back, or another in its place */
            status = update(options, request, id, &sent);
    }
    return status;
}

static int run(const struct cli_command *command, struct cli_args *args)
{
    struct options options = {0};
    cJSON *root = cJSON_CreateObject();
    int status = cli_parse(command, args, &options, root);
    if (status == CLI_OK && !options.common.help) {
        if (!options.common.count)
            status = cli_fail(CLI_USAGE, "Which scene? See penumbra watch --help.");
        else if (!options.output || !strcmp(options.output, "-"))
            status = cli_fail(CLI_USAGE, "Where to? Give -o FILE.");
        else
            status = cli_choose_format(options.output, root);
        char *request = cJSON_PrintUnformatted(root);
        if (status == CLI_OK)
            status = watch(&options, request);
        free(request);
    }
    cJSON_Delete(root);
    return status;
}

const struct cli_command cli_watch = {.name = "watch",
    .summary = "renders a scene each time its file changes",
    .words = "FILE -o IMAGE",
    .about =
        "Renders the scene in a file, and again whenever that, or a file that it names, is written "
        "or another one takes its place. What cannot be drawn is told, and the image stays; the "
        "server keeps the last version only. Ctrl-C ends it.",
    .rows = watch_rows,
    .offer = CLI_OFFER_FILES,
    .requests = CLI_RENDER_REQUEST,
    .most_words = 1,
    .run = run};
