#include "server/base/config.h"
#include "protocol/json_suggest.h"
#include "protocol/limits.h"
#include "protocol/param.h"
#include "renderer/device.h"
#include <ctype.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum kind { KIND_TEXT, KIND_NUMBER, KIND_SIZE, KIND_FLAG, KIND_CHOICE };

struct row {
    const char *name; /* the C field: its flag has dashes, its variable capitals */
    const char *help;
    const char *form; /* what the value looks like; NULL: as its kind says */
    const char *const *choices;
    const char *def;
    uint64_t min, max;
    uint16_t offset;
    uint8_t kind;
};

static const char *const log_format_names[] = {"text", "json", NULL};

#define KIND_OF(field)                                                                             \
    _Generic((field), char * : KIND_TEXT, uint64_t : KIND_NUMBER, config_size : KIND_SIZE,         \
             config_flag : KIND_FLAG, config_choice : KIND_CHOICE)
#define ROW(field, default_text, ...)                                                              \
    {                                                                                              \
        .name = #field, .def = default_text, .offset = offsetof(struct config, field),             \
        .kind = KIND_OF(((struct config *)0)->field), __VA_ARGS__                                  \
    }
#define TIME .form = "MS", .min = 1, .max = 86400000
#define SIZE .max = 1ull << 50
#define ADDRESS .form = "ADDRESS:PORT"
#define FILE_NAME .form = "FILE"

static const struct row rows[] = {
    ROW(listen, "127.0.0.1:8080", ADDRESS,
        .help = "Address and port of the public listener; port 0: any."),
    ROW(admin_listen, "127.0.0.1:8081", ADDRESS,
        .help = "Address and port of /livez, /readyz and /metrics, which ask for no token."),
    ROW(store, "penumbra-store", .form = "FOLDER",
        .help = "Folder of the stored scenes and images."),
    ROW(store_limit, "0", SIZE,
        .help = "What the store may hold; beyond it uploads are 507. 0: as much as the disk does. "
                "Results of jobs have a limit of their own."),
    ROW(device, "auto", .choices = pen_device_choice_names, .help = "Kind of device to render on."),
    ROW(device_index, "0", .max = 63,
        .help = "First GPU to use; further workers take the following ones."),
    ROW(require_gpu, "off", .help = "Refuse to render in software."),
    ROW(gl_debug, "off", .help = "Write OpenGL's debug messages to the log."),
    ROW(warm_up, "on",
        .help =
            "Compile what the usual request needs before the service says that it is ready, and "
            "the rest meanwhile."),
    ROW(gpu_memory, "2G", SIZE, .min = 1 << 20,
        .help = "Budget of each worker for scenes, images, shadow inputs and pictures being made."),
    ROW(workers, "1", .min = 1, .max = 16, .help = "Render processes: one per GPU."),
    ROW(queue_limit, "64", .min = 1, .max = 65536,
        .help = "Renders that may wait; beyond it the answer is 503."),
    ROW(client_share, "48", .max = 65536,
        .help = "Renders that one client may have under way; beyond it 429. 0: no limit."),
    ROW(scrub_s, "86400", .form = "SECONDS", .max = 31536000,
        .help = "How often all that is stored is read and checked, in idle time; 0: never."),
    ROW(result_cache, "256M", SIZE, .help = "Memory for encoded images; 0: keep none."),
    ROW(jobs, "256", .min = 1, .max = 10000, .help = "Jobs under way; beyond it 503."),
    ROW(jobs_share, "16", .min = 1, .max = 10000,
        .help = "Jobs that one client may have under way; beyond it 429."),
    ROW(jobs_kept, "10000", .min = 1, .max = 1000000,
        .help = "Jobs under way and over; beyond it 503, and 429 for a client who has a quarter."),
    ROW(jobs_keep_s, "86400", .form = "SECONDS", .min = 1, .max = 31536000,
        .help = "How long a job that is over is kept with its results, and Idempotency-Keys."),
    ROW(jobs_limit, "8G", SIZE, .min = 1,
        .help = "Room for the results of jobs; beyond it new jobs get 503, and those under way "
                "fail."),
    ROW(hang_timeout_ms, "60000", TIME,
        .help = "A worker that has work and gives no sign of life for so long is replaced, or "
                "sooner (10 s) when that is far longer than it ever took."),
    ROW(silence_timeout_ms, "8000", TIME,
        .help = "A worker whose process stands still for so long is replaced."),
    ROW(canary_interval_ms, "5000", TIME, .help = "How long /readyz trusts its last test render."),
    ROW(quarantine_s, "600", .form = "SECONDS", .max = 86400,
        .help = "How long a scene that ended two workers is refused."),
    ROW(connections, "512", .min = 4, .max = 60000,
        .help = "Public connections; beyond it idle and slow ones are ended, or it is 503."),
    ROW(connections_per_address, "256", .min = 1, .max = 60000,
        .help = "Public connections from one address; beyond it its idle and slow ones are ended, "
                "or it is 429."),
    ROW(http_threads, "2", .min = 1, .max = 64, .help = "Threads of the public listener."),
    ROW(header_timeout_ms, "10000", TIME, .help = "Time to send a whole request header."),
    ROW(keep_alive_ms, "30000", TIME, .help = "How long an idle connection is kept."),
    ROW(body_rate, "16K", SIZE, .min = 1,
        .help = "Slowest body that is accepted, bytes per second, after five seconds."),
    ROW(upload_limit, "1G", .min = 1, .max = PEN_MAX_UPLOAD_BYTES, .help = "Largest upload."),
    ROW(uploads, "16", .min = 1, .max = 1024,
        .help = "Uploads at a time; beyond it slow ones are ended, and beyond twice as many it "
                "is 503."),
    ROW(imports, "2", .min = 1, .max = 64, .help = "Importer processes at a time."),
    ROW(import_timeout_ms, "120000", TIME, .help = "Wall-clock limit of one import."),
    ROW(import_cpu_seconds, "60", .form = "SECONDS", .min = 1, .max = 86400,
        .help = "Processor limit of one import."),
    ROW(import_memory, "2G", SIZE, .min = 1 << 20, .help = "Memory limit of one import."),
    ROW(drain_timeout_ms, "60000", TIME,
        .help = "On SIGTERM, how long accepted requests may take to be answered."),
    ROW(token_file, "", FILE_NAME,
        .help = "Bearer tokens, one a line: \"name token\", and behind them scopes "
                "(read,render,upload,admin) and limits (requests_per_s=N renders=N "
                "stored_bytes=N). Read again on SIGHUP, as are certificates."),
    ROW(tls_cert, "", FILE_NAME, .help = "Certificate chain of the public listener, PEM."),
    ROW(tls_key, "", FILE_NAME, .help = "Its private key, PEM."),
    ROW(insecure, "off", .help = "Listen beyond loopback without tokens."),
    ROW(cors_origin, "", .form = "ORIGIN",
        .help = "Origin that pages may call from, or *; empty: none."),
    ROW(allow_host, "", .form = "NAMES",
        .help = "Names that this service is called by, with commas, or * for any. Addresses, "
                "names without a dot and the machine's own are always taken."),
    ROW(public_url, "", .form = "URL",
        .help = "What others call this service, behind a proxy: its name is taken, and links begin "
                "with its path."),
    ROW(trusted_proxy, "", .form = "ADDRESSES",
        .help = "Proxies, as addresses or networks with commas, whose X-Forwarded-For, -Host, "
                "-Proto and "
                "-Prefix are believed."),
    ROW(worker_path, "", FILE_NAME, .help = "penumbra-worker; empty: next to penumbrad."),
    ROW(import_path, "", FILE_NAME, .help = "penumbra-import; empty: next to penumbrad."),
    ROW(log_format, "text", .choices = log_format_names, .help = "Form of the log, on stderr."),
    ROW(config, "", FILE_NAME,
        .help =
            "Settings, one a line: \"queue-limit = 64\"; # begins a comment line. Variables and "
            "flags have the last word."),
    ROW(print_config, "off", .help = "Print all settings, as such a file, and end."),
    ROW(print_openapi, "off", .help = "Print /openapi.json, for makers of clients, and end."),
};
#define ROWS (sizeof rows / sizeof *rows)

/* The others are only of one start. */
static bool is_setting(const struct row *row)
{
    return row->offset != offsetof(struct config, config) &&
           row->offset != offsetof(struct config, print_config) &&
           row->offset != offsetof(struct config, print_openapi);
}

static void flag_name(const struct row *row, char *text)
{
    char *at = text + sprintf(text, "--");
    for (const char *c = row->name; *c; c++)
        *at++ = *c == '_' ? '-' : *c;
    *at = 0;
}

static void variable_name(const struct row *row, char *text)
{
    char *at = text + sprintf(text, "PENUMBRA_");
    for (const char *c = row->name; *c; c++)
        *at++ = (char)toupper((unsigned char)*c);
    *at = 0;
}

static bool parse_number(const struct row *row, const char *text, uint64_t *value)
{
    char *end;
    errno = 0;
    *value = strtoull(text, &end, 10);
    if (!isdigit((unsigned char)*text) || errno)
        return false;
    int shift = 0;
    if (row->kind == KIND_SIZE && *end) {
        shift = *end == 'K' ? 10 : *end == 'M' ? 20 : *end == 'G' ? 30 : 0;
        if (!shift || *value > UINT64_MAX >> shift)
            return false;
        end++;
    }
    *value <<= shift;
    return *end == 0;
}

/* "8", "16K", "1G": as short as the flag takes it. */
static void print_number(const struct row *row, uint64_t value, char text[24])
{
    int unit = 0;
    while (row->kind == KIND_SIZE && value && !(value & 1023) && unit < 3) {
        value >>= 10;
        unit++;
    }
    snprintf(text, 24, "%llu%.1s", (unsigned long long)value, &"\0KMG"[unit]);
}

static bool fail_range(
    const struct row *row, const char *source, const char *text, struct pen_error *error)
{
    char min[24], max[24];
    print_number(row, row->min, min);
    print_number(row, row->max, max);
    return pen_fail(error, PEN_INVALID, "",
        "%s must be a whole number from %s to %s%s, not \"%.40s\".", source, min, max,
        row->kind == KIND_SIZE ? ", of bytes or with K, M or G" : "", text);
}

static bool fail_choice(
    const struct row *row, const char *source, const char *text, struct pen_error *error)
{
    char list[128] = "";
    for (int c = 0; row->choices[c]; c++)
        snprintf(list + strlen(list), sizeof list - strlen(list), "%s%s",
            !c                    ? ""
            : row->choices[c + 1] ? ", "
                                  : " or ",
            row->choices[c]);
    return pen_fail(error, PEN_INVALID, "", "%s must be %s, not \"%.40s\".", source, list, text);
}

static bool store(const struct row *row, struct config *config, const char *text,
    const char *source, struct pen_error *error)
{
    void *at = (char *)config + row->offset;
    uint64_t number = 0;
    int index;
    switch (row->kind) {
    case KIND_TEXT:
        if (strlen(text) >= CONFIG_TEXT_BYTES)
            return pen_fail(error, PEN_INVALID, "", "%s is too long.", source);
        strcpy(at, text);
        return true;
    case KIND_NUMBER:
    case KIND_SIZE:
        if (!parse_number(row, text, &number) || number < row->min || number > row->max)
            return fail_range(row, source, text, error);
        if (row->kind == KIND_SIZE)
            ((config_size *)at)->bytes = number;
        else
            *(uint64_t *)at = number;
        return true;
    case KIND_FLAG:
        if (!strcmp(text, "1") || !strcmp(text, "on") || !strcmp(text, "true"))
            ((config_flag *)at)->on = true;
        else if (!strcmp(text, "0") || !strcmp(text, "off") || !strcmp(text, "false"))
            ((config_flag *)at)->on = false;
        else
            return pen_fail(
                error, PEN_INVALID, "", "%s must be on or off, not \"%.40s\".", source, text);
        return true;
    default:
        index = pen_choice_index(row->choices, text);
        if (index < 0)
            return fail_choice(row, source, text, error);
        ((config_choice *)at)->index = (uint32_t)index;
        return true;
    }
}

/* The row for "--queue-limit" or "--queue-limit=8"; *value points behind '=' or is NULL. */
static const struct row *find_flag(const char *argument, const char **value)
{
    size_t length = strcspn(argument, "=");
    *value = argument[length] ? argument + length + 1 : NULL;
    for (size_t r = 0; r < ROWS; r++) {
        char name[64];
        flag_name(&rows[r], name);
        if (strlen(name) == length && !strncmp(name, argument, length))
            return &rows[r];
    }
    return NULL;
}

/* What others call the address and port to listen on. */
static const char *const others_names[] = {"--port", "--host", "--bind", "--address", "--http"};

/* What to say of an argument that is no setting. */
static bool fail_flag(const char *argument, struct pen_error *error)
{
    char names[ROWS][64], given[64], end[96];
    /* The dashes are alike in all and say nothing. */
    struct pen_suggestion suggestion = {.word = given + 2};
    if (strncmp(argument, "--", 2))
        return pen_fail(error, PEN_INVALID, "",
            "\"%.60s\" is no setting: they look like --queue-limit 64; see --help.", argument);
    snprintf(given, sizeof given, "%.*s", (int)strcspn(argument, "="), argument);
    for (size_t r = 0; r < ROWS; r++) {
        flag_name(&rows[r], names[r]);
        pen_suggest(&suggestion, names[r] + 2);
    }
    if (suggestion.best)
        suggestion.best -= 2;
    for (size_t i = 0; i < sizeof others_names / sizeof *others_names; i++)
        if (!strcmp(given, others_names[i]))
            suggestion.best = "--listen";
    return pen_fail(error, PEN_INVALID, "", "There is no setting %s%s", given,
        pen_suggest_end(&suggestion, end, sizeof end));
}

/* The environment, then the command line. */
static bool read_outside(struct config *config, int argc, char **argv, struct pen_error *error)
{
    for (size_t r = 0; r < ROWS; r++) {
        char name[64];
        variable_name(&rows[r], name);
        const char *text = getenv(name);
        if (text && !store(&rows[r], config, text, name, error))
            return false;
    }
    for (int i = 1; i < argc; i++) {
        const char *value;
        const struct row *row = find_flag(argv[i], &value);
        if (!row)
            return fail_flag(argv[i], error);
        char name[64];
        flag_name(row, name);
        bool follows = i + 1 < argc && strncmp(argv[i + 1], "--", 2);
        if (!value && follows)
            value = argv[++i];
        else if (!value && row->kind == KIND_FLAG)
            value = "on";
        if (!value)
            return pen_fail(error, PEN_INVALID, "", "%s needs a value.", name);
        if (!store(row, config, value, name, error))
            return false;
    }
    return true;
}

/* Cuts off blanks at both ends. */
static char *trim(char *text)
{
    text += strspn(text, " \t\r\n");
    for (size_t n = strlen(text); n && strchr(" \t\r\n", text[n - 1]); n--)
        text[n - 1] = 0;
    return text;
}

/* A line of the file; `place` is "name:12". */
static bool read_line(struct config *config, char *line, const char *place, struct pen_error *error)
{
    char flag[CONFIG_TEXT_BYTES + 64], source[256];
    const char *ignored;
    struct pen_error unknown = {0};
    line = trim(line);
    if (!*line || *line == '#')
        return true;
    char *value = strchr(line, '=');
    if (value)
        *value++ = 0;
    snprintf(flag, sizeof flag, "--%s", trim(line));
    const struct row *row = find_flag(flag, &ignored);
    snprintf(source, sizeof source, "%s: %.60s", place, flag + 2);
    if (!row) {
        fail_flag(flag, &unknown);
        return pen_fail(error, PEN_INVALID, "", "%s: %s", place, unknown.message);
    }
    if (!is_setting(row))
        return pen_fail(error, PEN_INVALID, "", "%s cannot stand in a file.", source);
    if (!value)
        return pen_fail(error, PEN_INVALID, "", "%s needs a value.", source);
    return store(row, config, trim(value), source, error);
}

static bool read_file(struct config *config, struct pen_error *error)
{
    char line[CONFIG_TEXT_BYTES + 128], place[160], path[CONFIG_TEXT_BYTES];
    strcpy(path, config->config);
    FILE *file = fopen(path, "re");
    if (!file)
        return pen_fail(
            error, PEN_UNAVAILABLE, "", "%.200s cannot be read: %s.", path, strerror(errno));
    bool ok = true;
    for (int number = 1; ok && fgets(line, sizeof line, file); number++) {
        snprintf(place, sizeof place, "%.120s:%d", path, number);
        ok = strlen(line) + 1 < sizeof line || feof(file)
                 ? read_line(config, line, place, error)
                 : pen_fail(error, PEN_INVALID, "", "%s: the line is too long.", place);
    }
    if (ok && ferror(file))
        ok = pen_fail(
            error, PEN_UNAVAILABLE, "", "%.200s cannot be read: %s.", path, strerror(errno));
    fclose(file);
    return ok;
}

bool config_read(struct config *config, int argc, char **argv, struct pen_error *error)
{
    memset(config, 0, sizeof *config);
    for (size_t r = 0; r < ROWS; r++)
        if (!store(&rows[r], config, rows[r].def, rows[r].name, error))
            return false;
    if (!read_outside(config, argc, argv, error)) /* which says where the file is */
        return false;
    if (*config->config && (!read_file(config, error) || !read_outside(config, argc, argv, error)))
        return false;
    if (!*config->tls_cert != !*config->tls_key)
        return pen_fail(error, PEN_INVALID, "", "--tls-cert and --tls-key go together.");
    return true;
}

void config_print(const struct config *config, FILE *to)
{
    for (size_t r = 0; r < ROWS; r++) {
        const struct row *row = &rows[r];
        const void *at = (const char *)config + row->offset;
        char name[64], number[24];
        flag_name(row, name);
        if (!is_setting(row))
            continue;
        fprintf(to, "%s = ", name + 2);
        switch (row->kind) {
        case KIND_TEXT:
            fprintf(to, "%s\n", (const char *)at);
            break;
        case KIND_NUMBER:
        case KIND_SIZE:
            print_number(row,
                row->kind == KIND_SIZE ? ((const config_size *)at)->bytes : *(const uint64_t *)at,
                number);
            fprintf(to, "%s\n", number);
            break;
        case KIND_FLAG:
            fprintf(to, "%s\n", ((const config_flag *)at)->on ? "on" : "off");
            break;
        default:
            fprintf(to, "%s\n", row->choices[((const config_choice *)at)->index]);
        }
    }
}

/* "  --queue-limit N", and its help below. */
static void print_help(const struct row *row)
{
    static const char *const forms[] = {[KIND_TEXT] = "TEXT",
        [KIND_NUMBER] = "N",
        [KIND_SIZE] = "SIZE",
        [KIND_FLAG] = "on|off",
        [KIND_CHOICE] = ""};
    char name[64], min[24], max[24];
    flag_name(row, name);
    printf("  %s %s", name, row->form ? row->form : forms[row->kind]);
    for (int c = 0; row->choices && row->choices[c]; c++)
        printf("%s%s", c ? "|" : "", row->choices[c]);
    printf("\n      %s", row->help);
    if (row->kind == KIND_NUMBER || row->kind == KIND_SIZE) {
        print_number(row, row->min, min);
        print_number(row, row->max, max);
        printf(" %s to %s.", min, max);
    }
    printf(" [%s]\n", row->def);
}

bool config_answer_help(int argc, char **argv)
{
    for (int i = 1; i < argc; i++) {
        if (!strcmp(argv[i], "--version")) {
            printf("penumbrad %s\n", PENUMBRA_VERSION);
            return true;
        }
        if (strcmp(argv[i], "--help"))
            continue;
        printf("penumbrad %s: renders soft shadows over HTTP.\n\n"
               "--flag value and --flag=value are the same, an on|off flag alone means on, and\n"
               "every flag is also a variable: --queue-limit is PENUMBRA_QUEUE_LIMIT. SIZE is in\n"
               "bytes, or with K, M or G; MS are milliseconds. Defaults stand in brackets.\n\n",
            PENUMBRA_VERSION);
        for (size_t r = 0; r < ROWS; r++)
            print_help(&rows[r]);
        return true;
    }
    return false;
}
