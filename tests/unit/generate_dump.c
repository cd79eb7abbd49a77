/* generate_dump KIND TRIANGLES blob|glb > file */
#include "renderer/generate/generate.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

int main(int argc, char **argv)
{
    if (argc != 4)
        return 2;
    struct pen_generated_options options = {
        .kind = PEN_GENERATED_KINDS, .triangles = (uint32_t)strtoul(argv[2], NULL, 10), .seed = 5};
    for (uint32_t k = 0; k < PEN_GENERATED_KINDS; k++)
        if (!strcmp(argv[1], pen_generated_names[k]))
            options.kind = k;
    struct pen_error error = {0};
    void *data;
    size_t bytes;
    bool ok = strcmp(argv[3], "glb") ? pen_generate_blob(&options, &data, &bytes, &error)
                                     : pen_generate_glb(&options, &data, &bytes, &error);
    if (!ok) {
        fprintf(stderr, "%s\n", error.message);
        return 1;
    }
    ok = fwrite(data, 1, bytes, stdout) == bytes && fflush(stdout) == 0;
    free(data);
    return ok ? 0 : 1;
}
