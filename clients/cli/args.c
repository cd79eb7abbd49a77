#include "clients/cli/cli.h"
#include "protocol/limits.h"
#include <math.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

int cli_fail(int code, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    fputs("penumbra: ", stderr);
    vfprintf(stderr, format, args);
    fputc('\n', stderr);
    va_end(args);
    return code;
}

char *cli_format(const char *format, ...)
{
    char *text;
    va_list args;
    va_start(args, format);
    if (vasprintf(&text, format, args) < 0)
        abort();
    va_end(args);
    return text;
}

/* What stands behind "--name" in `argument`: "" or "=value"; NULL when it is another option. */
static const char *match(const char *argument, const char *name)
{
    size_t length = strlen(name);
    if (length == 1 && argument[0] == '-' && argument[1] == name[0])
        return argument[2] ? NULL : argument + 2;
    if (strncmp(argument, "--", 2) || strncmp(argument + 2, name, length))
        return NULL;
    argument += 2 + length;
    return *argument == 0 || *argument == '=' ? argument : NULL;
}

bool cli_option(struct cli_args *args, const char *name, const char **value)
{
    const char *rest = args->at < args->count ? match(args->argv[args->at], name) : NULL;
    if (!rest)
        return false;
    args->at++;
    if (*rest == '=')
        *value = rest + 1;
    else if (args->at < args->count)
        *value = args->argv[args->at++];
    else {
        *value = "";
        args->status = cli_fail(CLI_USAGE, "--%s needs a value.", name);
    }
    return true;
}

bool cli_flag(struct cli_args *args, const char *name)
{
    const char *rest = args->at < args->count ? match(args->argv[args->at], name) : NULL;
    if (!rest || *rest)
        return false;
    args->at++;
    return true;
}

const char *cli_positional(struct cli_args *args)
{
    if (args->at == args->count)
        return NULL;
    const char *argument = args->argv[args->at];
    if (argument[0] == '-' && argument[1])
        return NULL;
    args->at++;
    return argument;
}

int cli_unknown(const struct cli_args *args, const char *command)
{
    return cli_fail(
        CLI_USAGE, "Unknown argument %s; see penumbra %s --help.", args->argv[args->at], command);
}

void cli_server_init(struct cli_server *server)
{
    const char *base = getenv("PENUMBRA_SERVER");
    *server = (struct cli_server){.retries = 4};
    snprintf(
        server->base, sizeof server->base, "%s", base && *base ? base : "http://127.0.0.1:8080");
}

/* A finite number in the notation of JSON, or close to it, and nothing else. */
static bool is_number(const char *text, double *number)
{
    char *end;
    if (!*text || text[strspn(text, "+-.0123456789eE")])
        return false;
    *number = strtod(text, &end);
    return end != text && !*end && isfinite(*number);
}

static cJSON *guess_vector(const char *text)
{
    char *copy = cli_format("%s", text), *save = NULL;
    cJSON *array = cJSON_CreateArray();
    for (char *item = strtok_r(copy, ",", &save); array && item;
         item = strtok_r(NULL, ",", &save)) {
        double number;
        if (is_number(item, &number)) {
            cJSON_AddItemToArray(array, cJSON_CreateNumber(number));
            continue;
        }
        cJSON_Delete(array);
        array = NULL;
    }
    free(copy);
    return array;
}

cJSON *cli_guess(const char *text)
{
    double number;
    cJSON *array;
    if (!strcmp(text, "true") || !strcmp(text, "false"))
        return cJSON_CreateBool(*text == 't');
    if (is_number(text, &number))
        return cJSON_CreateNumber(number);
    if (strchr(text, ',') && (array = guess_vector(text)))
        return array;
    return cJSON_CreateString(text);
}

bool cli_is_id(const char *text)
{
    return strlen(text) == PEN_ID_HEX && cli_is_prefix(text);
}

bool cli_is_prefix(const char *text)
{
    size_t digits = strlen(text);
    return digits >= PEN_ID_PREFIX && digits <= PEN_ID_HEX &&
           strspn(text, "0123456789abcdef") == digits;
}
