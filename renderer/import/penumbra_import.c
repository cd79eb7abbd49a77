/* penumbra-import: one upload, one process. See import_process.h. */
#include "protocol/request.h"
#include "protocol/memory.h"
#include "renderer/import/import.h"
#include "renderer/import/import_process.h"
#include "renderer/import/sandbox.h"
#include <cjson/cJSON.h>
#include <errno.h>
#include <getopt.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#define OUTPUT_BYTES (4ull << 30)

struct options {
    enum pen_import_mode mode;
    uint8_t source[PEN_ID_BYTES];
    uint32_t memory_mb, cpu_seconds;
    uint64_t output_bytes; /* at most OUTPUT_BYTES */
};

/* What the handlers below send: filled before any untrusted byte is read. */
static struct pen_error out_of_memory, out_of_time;

static void report(const struct pen_error *error)
{
    ssize_t n;
    do
        n = write(PEN_IMPORT_REPORT_FD, error, sizeof *error); /* below PIPE_BUF: in one piece */
    while (n < 0 && errno == EINTR);
}

static void on_signal(int number)
{
    report(number == SIGXCPU ? &out_of_time : &out_of_memory);
    _exit(0);
}

static void prepare_handlers(const struct options *options)
{
    pen_fail(&out_of_memory, PEN_TOO_BIG, "",
        "The upload needs more than the %u MB that an import may use, or breaks a check.",
        options->memory_mb);
    pen_fail(&out_of_time, PEN_TOO_BIG, "",
        "The upload needs more than the %u CPU seconds that an import may use.",
        options->cpu_seconds);
    struct sigaction action = {.sa_handler = on_signal, .sa_flags = SA_RESETHAND};
    sigaction(SIGABRT, &action, NULL);
    sigaction(SIGXCPU, &action, NULL);
}

static bool parse_number(const char *text, uint32_t most, uint32_t *number)
{
    char *end;
    unsigned long n = strtoul(text, &end, 10);
    *number = (uint32_t)n;
    return text[0] >= '0' && text[0] <= '9' && !*end && n >= 1 && n <= most;
}

/* Any number is right: beyond OUTPUT_BYTES it is no limit of its own. */
static bool parse_bytes(const char *text, uint64_t *bytes)
{
    char *end;
    unsigned long long n = strtoull(text, &end, 10);
    *bytes = n < OUTPUT_BYTES ? n : OUTPUT_BYTES;
    return text[0] >= '0' && text[0] <= '9' && !*end;
}

static bool parse_options(int argc, char **argv, struct options *options)
{
    static const struct option names[] = {{"mode", required_argument, NULL, 'm'},
        {"source-id", required_argument, NULL, 'i'}, {"memory-mb", required_argument, NULL, 'M'},
        {"cpu-seconds", required_argument, NULL, 'c'},
        {"output-bytes", required_argument, NULL, 'o'}, {NULL, 0, NULL, 0}};
    bool have_mode = false, have_source = false;
    for (int c; (c = getopt_long(argc, argv, "", names, NULL)) != -1;) {
        if (c == 'm' && (!strcmp(optarg, "scene") || !strcmp(optarg, "image"))) {
            options->mode = optarg[0] == 's' ? PEN_IMPORT_SCENE : PEN_IMPORT_IMAGE;
            have_mode = true;
        } else if (c == 'i' && pen_id_from_hex(optarg, options->source)) {
            have_source = true;
        } else if (!(c == 'M' && parse_number(optarg, 1 << 20, &options->memory_mb)) &&
                   !(c == 'o' && parse_bytes(optarg, &options->output_bytes)) &&
                   !(c == 'c' && parse_number(optarg, 86400, &options->cpu_seconds))) {
            return false;
        }
    }
    return have_mode && have_source && optind == argc;
}

static bool fits(const struct options *options, size_t bytes, struct pen_error *error)
{
    return bytes <= options->output_bytes ||
           pen_fail(error, PEN_FULL, "",
               "Imported, the upload takes %.1f MiB; the store has room for %.1f MiB. Delete what "
               "is no "
               "longer used, or have --store-limit raised.",
               (double)bytes / (1 << 20), (double)options->output_bytes / (1 << 20));
}

static bool write_output(const uint8_t *blob, size_t bytes, struct pen_error *error)
{
    while (bytes) {
        ssize_t n = write(PEN_IMPORT_OUTPUT_FD, blob, bytes < 1u << 30 ? bytes : 1u << 30);
        if (n < 0 && errno == EINTR)
            continue;
        if (n <= 0)
            return pen_fail(error, errno == ENOSPC || errno == EDQUOT ? PEN_FULL : PEN_INTERNAL, "",
                "The imported scene could not be stored: %s.", strerror(errno));
        blob += n;
        bytes -= (size_t)n;
    }
    return true;
}

static bool run(const struct options *options, struct pen_error *error)
{
    const struct pen_sandbox_limits limits = {.memory_bytes = (uint64_t)options->memory_mb << 20,
        .output_bytes = options->output_bytes,
        .cpu_seconds = options->cpu_seconds};
    struct stat source;
    if (fstat(PEN_IMPORT_SOURCE_FD, &source))
        return pen_fail(error, PEN_INTERNAL, "", "The upload was not handed to the importer.");
    size_t bytes = (size_t)source.st_size;
    void *data = NULL, *blob = NULL;
    if (bytes > PEN_MAX_UPLOAD_BYTES)
        return pen_fail(
            error, PEN_TOO_BIG, "", "The upload is larger than %llu bytes.", PEN_MAX_UPLOAD_BYTES);
    /* Mapped before the sandbox so that it does not count against the memory; read after. */
    if (bytes)
        data = mmap(NULL, bytes, PROT_READ, MAP_PRIVATE, PEN_IMPORT_SOURCE_FD, 0);
    if (data == MAP_FAILED)
        return pen_fail(error, PEN_INTERNAL, "", "The upload could not be mapped.");
    size_t blob_bytes;
    return pen_sandbox_enter(&limits, error) &&
           pen_import(data, bytes, options->mode, options->source, &blob, &blob_bytes, error) &&
           fits(options, blob_bytes, error) && write_output(blob, blob_bytes, error);
}

/* Memory that runs out is told as such, not as text that cannot be parsed. */
static void *allocate(size_t bytes)
{
    return pen_alloc(bytes, 1);
}

int main(int argc, char **argv)
{
    struct options options = {.memory_mb = 2048, .cpu_seconds = 60, .output_bytes = OUTPUT_BYTES};
    if (!parse_options(argc, argv, &options)) {
        fprintf(stderr, "usage: penumbra-import --mode scene|image --source-id <64 hex digits> "
                        "[--memory-mb 2048] [--cpu-seconds 60] [--output-bytes 4294967296]\n"
                        "Run by penumbrad with the upload on descriptor 3.\n");
        return 2;
    }
    prepare_handlers(&options);
    cJSON_InitHooks(&(cJSON_Hooks){allocate, free});
    struct pen_error error = {0};
    run(&options, &error);
    report(&error);
    _exit(0); /* nothing is worth being torn down */
}
