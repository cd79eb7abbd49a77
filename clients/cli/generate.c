#include "clients/cli/cli.h"
#include "protocol/param.h"
#include "renderer/generate/generate.h"
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static void help(void)
{
    puts("penumbra generate KIND -o FILE [options]\n"
         "\n"
         "Makes a scene: a .glb to upload, or a .pscene for the renderer's own tools.\n"
         "\n"
         "  --triangles N         about so many (hairball, foliage, columns)\n"
         "  --seed N              another scene of the same kind\n"
         "  --caster-height M     metres above the receiver\n"
         "  --caster-half-size M  square caster\n"
         "  --second-height M     lower caster (stacked, duplicate)\n"
         "\n"
         "Kinds:");
    for (int i = 0; i < PEN_GENERATED_KINDS; i++)
        printf("  %s\n", pen_generated_names[i]);
}

/* Consumes --name with a number from min to max. */
static bool number_option(
    struct cli_args *args, const char *name, double min, double max, bool whole, double *number)
{
    const char *value;
    char *end;
    if (!cli_option(args, name, &value))
        return false;
    *number = strtod(value, &end);
    if (!args->status && (end == value || *end || !(*number >= min && *number <= max) ||
                             (whole && *number != (double)(uint64_t)*number)))
        args->status = cli_fail(CLI_USAGE, "--%s takes a %snumber from %g to %g.", name,
            whole ? "whole " : "", min, max);
    return true;
}

static int write_file(const char *path, const void *data, size_t bytes)
{
    char *part = cli_format("%s.part", path);
    FILE *file = fopen(part, "wb");
    bool ok = file && fwrite(data, 1, bytes, file) == bytes;
    if (file && fclose(file))
        ok = false;
    ok = ok && !rename(part, path);
    if (!ok)
        unlink(part);
    free(part);
    return ok ? CLI_OK : cli_fail(CLI_FAILED, "%s cannot be written.", path);
}

int cli_generate(struct cli_args *args)
{
    struct pen_generated_options options = {0};
    const char *kind_name = NULL, *output = NULL, *word;
    int kind = -1;
    double value;
    while (args->at < args->count && args->status == CLI_OK) {
        if (cli_option(args, "o", &output))
            continue;
        if (number_option(args, "triangles", 1, 3e6, true, &value))
            options.triangles = (uint32_t)value;
        else if (number_option(args, "seed", 0, 4294967295.0, true, &value))
            options.seed = (uint32_t)value;
        else if (number_option(args, "caster-height", 1e-3, 1e3, false, &value))
            options.caster_height = (float)value;
        else if (number_option(args, "caster-half-size", 1e-3, 1e3, false, &value))
            options.caster_half_size = (float)value;
        else if (number_option(args, "second-height", 1e-3, 1e3, false, &value))
            options.second_height = (float)value;
        else if (cli_flag(args, "help") || cli_flag(args, "h")) {
            help();
            return CLI_OK;
        } else if (!kind_name && (word = cli_positional(args)))
            kind_name = word;
        else
            return cli_unknown(args, "generate");
    }
    if (args->status != CLI_OK)
        return args->status;
    for (int i = 0; kind_name && i < PEN_GENERATED_KINDS; i++)
        if (!strcmp(kind_name, pen_generated_names[i]))
            kind = i;
    if (kind < 0)
        return cli_fail(CLI_USAGE, "Which kind of scene? See penumbra generate --help.");
    if (!output || !*output)
        return cli_fail(CLI_USAGE, "Where to? Give -o FILE.");
    options.kind = (uint32_t)kind;
    struct pen_error error = {0};
    void *data = NULL;
    size_t bytes = 0;
    const char *dot = strrchr(output, '.');
    bool blob = dot && !strcmp(dot, ".pscene");
    bool ok = blob ? pen_generate_blob(&options, &data, &bytes, &error)
                   : pen_generate_glb(&options, &data, &bytes, &error);
    int status = ok ? write_file(output, data, bytes) : cli_fail(CLI_FAILED, "%s", error.message);
    free(data);
    return status;
}
