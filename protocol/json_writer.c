#include "protocol/json_writer.h"
#include "protocol/memory.h"
#include "protocol/number.h"
#include "protocol/request.h"
#include "protocol/utf8.h"
#include <assert.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void put(struct pen_json *json, const char *text, size_t bytes)
{
    json->text = pen_grow(json->text, &json->capacity, json->size + bytes + 1, 1);
    memcpy(json->text + json->size, text, bytes);
    json->size += bytes;
    json->text[json->size] = 0;
}

static void put_text(struct pen_json *json, const char *text)
{
    put(json, text, strlen(text));
}

static void put_escaped(struct pen_json *json, const char *text)
{
    const unsigned char *s = (const unsigned char *)text;
    size_t left = strlen(text);
    while (left) {
        size_t length = pen_utf8_length((const char *)s, left);
        char escape[8];
        if (length == 0) {
            put(json, "\xef\xbf\xbd", 3); /* U+FFFD */
            length = 1;
        } else if (*s == '"' || *s == '\\') {
            escape[0] = '\\';
            escape[1] = (char)*s;
            put(json, escape, 2);
        } else if (*s == '\n')
            put(json, "\\n", 2);
        else if (*s < 0x20 || *s == 0x7f) {
            snprintf(escape, sizeof escape, "\\u%04x", *s);
            put(json, escape, 6);
        } else
            put(json, (const char *)s, length);
        s += length;
        left -= length;
    }
}

static void put_quoted(struct pen_json *json, const char *text)
{
    put(json, "\"", 1);
    put_escaped(json, text);
    put(json, "\"", 1);
}

/* Comma and key in front of an item. */
static void begin_item(struct pen_json *json, const char *key)
{
    if (json->depth) {
        uint64_t bit = 1ull << (json->depth - 1);
        if (json->filled & bit)
            put(json, ",", 1);
        json->filled |= bit;
        assert(!key == !!(json->arrays & bit));
    } else
        assert(!key && !json->size);
    if (key) {
        put_quoted(json, key);
        put(json, ":", 1);
    }
}

static void open_container(struct pen_json *json, const char *key, bool array)
{
    begin_item(json, key);
    assert(json->depth < 64);
    uint64_t bit = 1ull << json->depth++;
    json->arrays = array ? json->arrays | bit : json->arrays & ~bit;
    json->filled &= ~bit;
    put(json, array ? "[" : "{", 1);
}

void pen_json_object(struct pen_json *json, const char *key)
{
    open_container(json, key, false);
}

void pen_json_array(struct pen_json *json, const char *key)
{
    open_container(json, key, true);
}

void pen_json_end(struct pen_json *json)
{
    assert(json->depth);
    uint64_t bit = 1ull << --json->depth;
    put(json, json->arrays & bit ? "]" : "}", 1);
}

void pen_json_raw(struct pen_json *json, const char *key, const char *text)
{
    begin_item(json, key);
    put_text(json, text);
}

void pen_json_string(struct pen_json *json, const char *key, const char *text)
{
    begin_item(json, key);
    if (text)
        put_quoted(json, text);
    else
        put_text(json, "null");
}

void pen_json_link(struct pen_json *json, const char *key, const char *path)
{
    static const char begin[] = {'"', PEN_JSON_LINK};
    begin_item(json, key);
    put(json, begin, sizeof begin);
    put_escaped(json, path);
    put(json, "\"", 1);
}

char *pen_json_put_links(char *text, const char *prefix)
{
    struct pen_json out = {0};
    const char *from = text, *mark;
    while ((mark = strchr(from, PEN_JSON_LINK))) {
        put(&out, from, (size_t)(mark - from));
        put_escaped(&out, prefix);
        from = mark + 1;
    }
    if (from == text)
        return text;
    put_text(&out, from);
    free(text);
    return out.text;
}

void pen_json_float(struct pen_json *json, const char *key, float value)
{
    char text[32] = "null";
    if (isfinite(value))
        pen_print_float(value, text);
    pen_json_raw(json, key, text);
}

void pen_json_double(struct pen_json *json, const char *key, double value)
{
    char text[32] = "null";
    if (isfinite(value))
        pen_print_double(value, text);
    pen_json_raw(json, key, text);
}

void pen_json_int(struct pen_json *json, const char *key, int64_t value)
{
    char text[32];
    snprintf(text, sizeof text, "%lld", (long long)value);
    pen_json_raw(json, key, text);
}

void pen_json_uint(struct pen_json *json, const char *key, uint64_t value)
{
    char text[32];
    snprintf(text, sizeof text, "%llu", (unsigned long long)value);
    pen_json_raw(json, key, text);
}

void pen_json_bool(struct pen_json *json, const char *key, bool value)
{
    pen_json_raw(json, key, value ? "true" : "false");
}

void pen_json_null(struct pen_json *json, const char *key)
{
    pen_json_raw(json, key, "null");
}

void pen_json_floats(struct pen_json *json, const char *key, const float *values, uint32_t count)
{
    pen_json_array(json, key);
    for (uint32_t i = 0; i < count; i++)
        pen_json_float(json, NULL, values[i]);
    pen_json_end(json);
}

void pen_json_doubles(struct pen_json *json, const char *key, const double *values, uint32_t count)
{
    pen_json_array(json, key);
    for (uint32_t i = 0; i < count; i++)
        pen_json_double(json, NULL, values[i]);
    pen_json_end(json);
}

void pen_json_id(struct pen_json *json, const char *key, const uint8_t *id)
{
    char text[PEN_ID_HEX + 1];
    pen_id_to_hex(id, text);
    pen_json_string(json, key, text);
}

static void write_component(
    struct pen_json *json, const char *key, const struct pen_param *row, double value)
{
    if (row->choices)
        pen_json_string(json, key, row->choices[(uint32_t)value]);
    else if (row->type == PEN_PARAM_FLAG)
        pen_json_bool(json, key, value != 0);
    else if (row->type == PEN_PARAM_FLOAT)
        pen_json_float(json, key, (float)value);
    else if (row->type == PEN_PARAM_DOUBLE)
        pen_json_double(json, key, value);
    else
        pen_json_int(json, key, (int64_t)value);
}

static void write_components(
    struct pen_json *json, const char *key, const struct pen_param *row, const double *values)
{
    if (row->count == 1) {
        write_component(json, key, row, values[0]);
        return;
    }
    pen_json_array(json, key);
    for (uint32_t i = 0; i < row->count; i++)
        write_component(json, NULL, row, values[i]);
    pen_json_end(json);
}

void pen_json_row(struct pen_json *json, const struct pen_param *row, const void *object)
{
    double values[4];
    if (pen_param_is_auto(row, object))
        return;
    if (pen_param_is_word(row, object)) {
        pen_json_string(json, row->name, row->word);
        return;
    }
    if (row->type == PEN_PARAM_TEXT) {
        pen_json_string(json, row->name, pen_param_load_text(row, object));
        return;
    }
    for (uint32_t i = 0; i < row->count; i++)
        values[i] = pen_param_load(row, object, i);
    write_components(json, row->name, row, values);
}

void pen_json_row_default(struct pen_json *json, const char *key, const struct pen_param *row)
{
    if (row->type == PEN_PARAM_TEXT)
        pen_json_string(json, key, "");
    else if (!row->automatic)
        write_components(json, key, row, row->def_v);
}

char *pen_json_finish(struct pen_json *json, size_t *bytes)
{
    assert(json->depth == 0 && json->size);
    char *text = json->text;
    if (bytes)
        *bytes = json->size;
    *json = (struct pen_json){0};
    return text;
}

void pen_json_discard(struct pen_json *json)
{
    free(json->text);
    *json = (struct pen_json){0};
}
