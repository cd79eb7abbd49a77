/* Runs while penumbra is built: writes the rows of every registered method as C. Linked with all of
 * the renderer, so that what it writes can be used without it. */
#include "renderer/renderer.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

/* A new field must be written here too. */
_Static_assert(sizeof(struct pen_param) == 104, "write_param");
_Static_assert(sizeof(struct pen_technique_info) == 88, "main");

static void write_text(const char *text)
{
    if (!text) {
        printf("NULL");
        return;
    }
    putchar('"');
    for (const unsigned char *c = (const unsigned char *)text; *c; c++)
        printf(
            *c < 0x20 || *c > 0x7e || *c == '"' || *c == '\\' || *c == '?' ? "\\%03o" : "%c", *c);
    putchar('"');
}

/* A list that ends with NULL, as an expression. */
static void write_list(const char *const *list)
{
    if (!list) {
        printf("NULL");
        return;
    }
    printf("((const char *const[]){");
    for (; *list; list++) {
        write_text(*list);
        printf(", ");
    }
    printf("NULL})");
}

static void write_number(double value)
{
    if (!isfinite(value))
        abort();
    printf("%a", value);
}

static void write_param(const struct pen_param *row)
{
    printf("    {.name = ");
    write_text(row->name);
    printf(", .help = ");
    write_text(row->help);
    printf(", .unit = ");
    write_text(row->unit);
    printf(", .choices = ");
    write_list(row->choices);
    printf(", .word = ");
    write_text(row->word);
    printf(", .def_v = {");
    for (int i = 0; i < 4; i++) {
        write_number(row->def_v[i]);
        printf(", ");
    }
    printf("}, .min = ");
    write_number(row->min);
    printf(", .max = ");
    write_number(row->max);
    printf(", .applies = %u, .offset = %u, .type = %u, .count = %u, .specialise = %u, "
           ".exclusive_min = %u},\n",
        row->applies, row->offset, row->type, row->count, row->specialise, row->exclusive_min);
}

int main(void)
{
    const struct pen_catalogue *catalogue = pen_renderer_catalogue();
    printf("#include \"renderer/catalogue/catalogue.h\"\n");
    for (uint32_t i = 0; i < catalogue->count; i++) {
        const struct pen_technique_info *info = catalogue->items[i];
        printf("static const struct pen_param rows_%u[] = {\n", i);
        for (uint32_t r = 0; r < info->params.count; r++)
            write_param(&info->params.rows[r]);
        printf("%s};\nstatic const struct pen_technique_info info_%u = {.name = ",
            info->params.count ? "" : "    {0},\n", i);
        write_text(info->name);
        printf(",\n    .title = ");
        write_text(info->title);
        printf(",\n    .summary = ");
        write_text(info->summary);
        printf(",\n    .citation = ");
        write_text(info->citation);
        printf(",\n    .artefacts = ");
        write_text(info->artefacts);
        printf(",\n    .cost_class = %u, .textured = %d, .keeps_history = %d, .struct_size = %u, "
               ".params = {rows_%u, %u},\n    .candidates = ",
            info->cost_class, info->textured, info->keeps_history, info->struct_size, i,
            info->params.count);
        write_list(info->candidates);
        printf(", .candidates_need_gpu = %d};\n", info->candidates_need_gpu);
    }
    printf("static const struct pen_technique_info *const items[] = {\n");
    for (uint32_t i = 0; i < catalogue->count; i++)
        printf("    &info_%u,\n", i);
    printf("};\nconst struct pen_catalogue pen_catalogue = {items, %u};\n", catalogue->count);
    return 0;
}
