#include "clients/cli/output.h"
#include "clients/cli/rows/command.h"
#include "clients/cli/rows/parse.h"
#include "protocol/param.h"
#include "renderer/generate/generate.h"
#include <stdlib.h>
#include <string.h>

struct options {
    struct cli_common common;
    const char *output;
    struct pen_generated_options scene;
};

/* A number from min to max; reports what else it is. */
static bool read_number(
    const char *name, const char *value, double min, double max, bool whole, double *number)
{
    char *end;
    *number = strtod(value, &end);
    if (end != value && !*end && *number >= min && *number <= max &&
        (!whole || *number == (double)(uint64_t)*number))
        return true;
    cli_fail(
        CLI_USAGE, "--%s takes a %snumber from %g to %g.", name, whole ? "whole " : "", min, max);
    return false;
}

/* A function that takes one number of the scene. */
#define TAKES(field, name, type, min, max, whole)                                                  \
    static bool take_##field(struct cli_args *args, void *options, const char *value)              \
    {                                                                                              \
        double number;                                                                             \
        (void)args;                                                                                \
        if (!read_number(name, value, min, max, whole, &number))                                   \
            return false;                                                                          \
        ((struct options *)options)->scene.field = (type)number;                                   \
        return true;                                                                               \
    }
TAKES(triangles, "triangles", uint32_t, 1, 3e6, true)
TAKES(seed, "seed", uint32_t, 0, 4294967295.0, true)
TAKES(caster_height, "caster-height", float, 1e-3, 1e3, false)
TAKES(caster_half_size, "caster-half-size", float, 1e-3, 1e3, false)
TAKES(second_height, "second-height", float, 1e-3, 1e3, false)
#undef TAKES

static const struct cli_row generate_rows[] = {
    {"o", "FILE", "A .glb to upload, or a .pscene for the renderer's own tools.", CLI_OFFER_FILES,
        .offset = offsetof(struct options, output)},
    {"triangles", "N", "About so many (hairball, foliage, columns).", .take = take_triangles},
    {"seed", "N", "Another scene of the same kind.", .take = take_seed},
    {"caster-height", "M", "Metres above the receiver.", .take = take_caster_height},
    {"caster-half-size", "M", "Half the side of the square caster, in metres.",
        .take = take_caster_half_size},
    {"second-height", "M", "The lower caster's, in metres (stacked, duplicate).",
        .take = take_second_height},
    {0},
};

static int write_file(const char *path, const void *data, size_t bytes)
{
    struct cli_output output;
    int status = cli_output_open(&output, path);
    if (status == CLI_OK)
        fwrite(data, 1, bytes, output.file);
    return cli_output_end(&output, status);
}

static int run(const struct cli_command *command, struct cli_args *args)
{
    struct options options = {0};
    int status = cli_parse(command, args, &options, NULL);
    if (status != CLI_OK || options.common.help)
        return status;
    const char *name = options.common.words[0], *output = options.output;
    int kind = name ? pen_choice_index(pen_generated_names, name) : -1;
    if (kind < 0)
        return cli_fail(CLI_USAGE, "Which kind of scene? See penumbra generate --help.");
    if (!output || !*output)
        return cli_fail(CLI_USAGE, "Where to? Give -o FILE.");
    options.scene.kind = (uint32_t)kind;
    struct pen_error error = {0};
    void *data = NULL;
    size_t bytes = 0;
    const char *dot = strrchr(output, '.');
    bool blob = dot && !strcmp(dot, ".pscene");
    bool ok = blob ? pen_generate_blob(&options.scene, &data, &bytes, &error)
                   : pen_generate_glb(&options.scene, &data, &bytes, &error);
    status = ok ? write_file(output, data, bytes) : cli_fail(CLI_FAILED, "%s", error.message);
    free(data);
    return status;
}

const struct cli_command cli_generate = {.name = "generate",
    .summary = "makes a demo or test scene",
    .words = "KIND -o FILE",
    .about = "Makes a scene by penumbra's own code: the demo, and those that the tests know the "
             "answer of.",
    .rows = generate_rows,
    .choices = pen_generated_names,
    .local = true,
    .most_words = 1,
    .run = run};
