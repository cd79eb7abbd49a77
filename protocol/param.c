#include "protocol/param.h"
#include "protocol/technique_info.h"
#include <assert.h>
#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

bool pen_param_is_real(const struct pen_param *row)
{
    return row->type == PEN_PARAM_FLOAT || row->type == PEN_PARAM_DOUBLE;
}

/* Bytes of one component. */
static size_t width(const struct pen_param *row)
{
    return row->type == PEN_PARAM_DOUBLE ? sizeof(double) : sizeof(float);
}

static void store(const struct pen_param *row, void *object, uint32_t i, double value)
{
    char *at = (char *)object + row->offset + width(row) * i;
    double d;
    float f;
    int32_t s;
    uint32_t u;
    switch (row->type) {
    case PEN_PARAM_FLOAT:
        f = (float)value + 0.0f; /* no -0: equal requests have equal bytes */
        memcpy(at, &f, 4);
        break;
    case PEN_PARAM_DOUBLE:
        d = value + 0.0;
        memcpy(at, &d, 8);
        break;
    case PEN_PARAM_INT:
        s = (int32_t)value;
        memcpy(at, &s, 4);
        break;
    default:
        u = (uint32_t)value;
        memcpy(at, &u, 4);
    }
}

double pen_param_load(const struct pen_param *row, const void *object, uint32_t i)
{
    const char *at = (const char *)object + row->offset + width(row) * i;
    double d;
    float f;
    int32_t s;
    uint32_t u;
    switch (row->type) {
    case PEN_PARAM_FLOAT:
        memcpy(&f, at, 4);
        return f;
    case PEN_PARAM_DOUBLE:
        memcpy(&d, at, 8);
        return d;
    case PEN_PARAM_INT:
        memcpy(&s, at, 4);
        return s;
    default:
        memcpy(&u, at, 4);
        return u;
    }
}

void pen_params_default(struct pen_param_table table, void *object)
{
    for (uint32_t r = 0; r < table.count; r++)
        for (uint32_t i = 0; i < table.rows[r].count; i++)
            if (table.rows[r].type == PEN_PARAM_TEXT)
                memset((char *)object + table.rows[r].offset, 0, table.rows[r].bytes);
            else
                store(&table.rows[r], object, i,
                    table.rows[r].automatic ? PEN_AUTO : table.rows[r].def_v[i]);
}

bool pen_param_is_auto(const struct pen_param *row, const void *object)
{
    return row->automatic && pen_param_load(row, object, 0) == PEN_AUTO;
}

bool pen_param_is_word(const struct pen_param *row, const void *object)
{
    double word = row->type == PEN_PARAM_FLAG ? PEN_FLAG_WORD : PEN_WORD;
    return row->word && pen_param_load(row, object, 0) == word;
}

bool pen_param_store_word(const struct pen_param *row, void *object, const char *text)
{
    if (!row->word || strcmp(row->word, text) != 0)
        return false;
    for (uint32_t i = 0; i < row->count; i++)
        store(row, object, i, row->type == PEN_PARAM_FLAG ? PEN_FLAG_WORD : PEN_WORD);
    return true;
}

const struct pen_param *pen_param_find(struct pen_param_table table, const char *name)
{
    for (uint32_t r = 0; r < table.count; r++)
        if (!strcmp(table.rows[r].name, name))
            return &table.rows[r];
    return NULL;
}

bool pen_param_store(const struct pen_param *row, void *object, const double *values,
    const char *pointer, struct pen_error *error)
{
    double min = row->min, max = row->max;
    if (row->type == PEN_PARAM_FLAG)
        min = 0, max = 1;
    if (row->choices) {
        min = max = 0;
        while (row->choices[(int)max + 1])
            max++;
    }
    for (uint32_t i = 0; i < row->count; i++) {
        double v = values[i];
        if (!isfinite(v))
            return pen_fail(error, PEN_INVALID, pointer, "%s must be a finite number.", row->name);
        if (!pen_param_is_real(row) && v != floor(v))
            return pen_fail(error, PEN_INVALID, pointer, "%s must be a whole number.", row->name);
        /* Compared as they are stored, so that a value that passes here passes again later. */
        double stored = v, low = min, high = max;
        if (row->type == PEN_PARAM_FLOAT)
            stored = (float)v, low = (float)min, high = (float)max;
        if (stored < low || stored > high || (row->exclusive_min && stored <= low))
            return pen_fail(error, PEN_INVALID, pointer, "%s is %g, but must lie in %c%g, %g].",
                row->name, v, row->exclusive_min ? '(' : '[', min, max);
    }
    for (uint32_t i = 0; i < row->count; i++)
        store(row, object, i, values[i]);
    return true;
}

bool pen_param_store_text(const struct pen_param *row, void *object, const char *text,
    const char *pointer, struct pen_error *error)
{
    char *to = (char *)object + row->offset;
    size_t length = strlen(text);
    if (length > row->bytes - 1u && row->whole)
        return pen_fail(
            error, PEN_INVALID, pointer, "%s is longer than %u bytes.", row->name, row->bytes - 1u);
    if (length > row->bytes - 1u) {
        length = row->bytes - 1u;
        while (length && ((unsigned char)text[length] & 0xc0) == 0x80)
            length--;
    }
    for (size_t i = 0; i < length; i++)
        if ((unsigned char)text[i] < 0x20 || text[i] == 0x7f)
            return pen_fail(
                error, PEN_INVALID, pointer, "%s holds a control character.", row->name);
    memset(to, 0, row->bytes);
    snprintf(to, row->bytes, "%.*s", (int)length, text);
    return true;
}

const char *pen_param_load_text(const struct pen_param *row, const void *object)
{
    return (const char *)object + row->offset;
}

bool pen_param_parse(const struct pen_param *row, void *object, const char *text,
    const char *pointer, struct pen_error *error)
{
    double values[4] = {0};
    if (pen_param_store_word(row, object, text))
        return true;
    if (row->type == PEN_PARAM_TEXT)
        return pen_param_store_text(row, object, text, pointer, error);
    if (row->choices) {
        int index = pen_choice_index(row->choices, text);
        if (index < 0)
            return pen_fail(
                error, PEN_INVALID, pointer, "%s has no choice called \"%.40s\".", row->name, text);
        values[0] = index;
    } else if (row->type == PEN_PARAM_FLAG) {
        if (!strcmp(text, "1") || !strcmp(text, "on") || !strcmp(text, "true"))
            values[0] = 1;
        else if (strcmp(text, "0") && strcmp(text, "off") && strcmp(text, "false"))
            return pen_fail(error, PEN_INVALID, pointer, "%s must be true%s false%s%s.", row->name,
                row->word ? "," : " or", row->word ? " or " : "", row->word ? row->word : "");
    } else {
        const char *at = text;
        for (uint32_t i = 0; i < row->count; i++) {
            char *end;
            errno = 0;
            values[i] = strtod(at, &end);
            bool last = i + 1 == row->count;
            /* strtod also takes hexadecimal floats and leading space: neither is a number here. */
            if (end == at || *end != (last ? '\0' : ',') ||
                strspn(at, "+-.0123456789eE") < (size_t)(end - at))
                return pen_fail(error, PEN_INVALID, pointer, "%s must be %u number%s%s%s.",
                    row->name, row->count, row->count > 1 ? "s separated by commas" : "",
                    row->word ? " or " : "", row->word ? row->word : "");
            at = end + 1;
        }
    }
    return pen_param_store(row, object, values, pointer, error);
}

int pen_choice_index(const char *const *choices, const char *name)
{
    for (int i = 0; choices[i]; i++)
        if (!strcmp(choices[i], name))
            return i;
    return -1;
}

const struct pen_technique_info *pen_catalogue_find(
    const struct pen_catalogue *catalogue, const char *name)
{
    for (uint32_t i = 0; i < catalogue->count; i++)
        if (!strcmp(catalogue->items[i]->name, name))
            return catalogue->items[i];
    return NULL;
}
