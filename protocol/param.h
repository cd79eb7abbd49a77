/* Parameter rows. One row, next to the C field it fills, is the only place where a parameter's
 * default, range, unit and help are written; JSON validation, OpenAPI, the command line, the docs
 * and GLSL are derived from it. */
#pragma once
#include "protocol/error.h"
#include <stddef.h>
#include <stdint.h>

/* A boolean that is 4 bytes wide and a type of its own, so that rows can tell it from a number. */
typedef struct {
    uint32_t on;
} pen_flag;

enum pen_param_type {
    PEN_PARAM_FLOAT,  /* float or float[n] */
    PEN_PARAM_INT,    /* int32_t */
    PEN_PARAM_UINT,   /* uint32_t; with .choices an enumeration whose value is the index */
    PEN_PARAM_FLAG,   /* pen_flag */
    PEN_PARAM_DOUBLE, /* double or double[n]: points of the world */
    PEN_PARAM_TEXT,   /* char[n], padded with zeros, the last one always zero; default "" */
};

struct pen_param {
    const char *name;           /* the C field, the JSON key and the GLSL name */
    const char *help;           /* one sentence, ends with a full stop */
    const char *unit;           /* "m", "px", "deg", "texel", ...; NULL: none */
    const char *const *choices; /* NULL-terminated names of an enumeration, or NULL */
    union {
        double def;      /* scalar default */
        double def_v[4]; /* vector default (count > 1) */
    };
    double min, max;    /* inclusive, for every component */
    uint32_t applies;   /* bit mask of the light types or camera modes that have this row; 0: all */
    uint16_t offset;    /* bytes from the start of the struct */
    uint8_t type;       /* enum pen_param_type */
    uint8_t count;      /* components, 1 to 4 */
    uint8_t bytes;      /* of the field */
    uint8_t specialise; /* 1: a constant of the shader, one program per value: for what chooses its
                           code, not for counts and sizes */
    uint8_t exclusive_min; /* 1: min itself is not allowed */
    uint8_t whole;         /* 1: a text that is too long is refused, not cut */
    uint8_t automatic; /* 1: left out, it holds PEN_AUTO until something that suits is chosen; def
                          is what such a choice starts from */
    const char *word;  /* may be given instead of numbers, or of true and false; NULL: none */
};

/* What every component of an automatic row (of floats) holds while nobody has given a value. */
#define PEN_AUTO (-3.402823466e38f)
/* What every component of a row of floats holds while its word is given, and what a flag does. */
#define PEN_WORD (-3.4e38f)
#define PEN_FLAG_WORD 2

#define PEN_PARAM_TYPE_OF(field)                                                                   \
    _Generic((field), float : PEN_PARAM_FLOAT, float * : PEN_PARAM_FLOAT, int32_t : PEN_PARAM_INT, \
             uint32_t : PEN_PARAM_UINT, pen_flag : PEN_PARAM_FLAG, double : PEN_PARAM_DOUBLE,           \
             double * : PEN_PARAM_DOUBLE, char * : PEN_PARAM_TEXT)
#define PEN_PARAM_COUNT_OF(field)                                                                  \
    _Generic((field), char * : 1, double : 1, double * : sizeof(field) / 8,                        \
        default : sizeof(field) / 4)

/* PARAM(struct pcss, search_taps, .def = 16, .min = 1, .max = 64, .help = "...") */
#define PARAM(aggregate, field, ...)                                                               \
    {                                                                                              \
        .name = #field, .offset = offsetof(aggregate, field),                                      \
        .type = PEN_PARAM_TYPE_OF(((aggregate *)0)->field),                                        \
        .count = PEN_PARAM_COUNT_OF(((aggregate *)0)->field),                                      \
        .bytes = sizeof(((aggregate *)0)->field), __VA_ARGS__                                      \
    }
/* The same with a JSON key that differs from the C field. */
#define PARAM_AS(aggregate, field, key, ...)                                                       \
    {                                                                                              \
        .name = key, .offset = offsetof(aggregate, field),                                         \
        .type = PEN_PARAM_TYPE_OF(((aggregate *)0)->field),                                        \
        .count = PEN_PARAM_COUNT_OF(((aggregate *)0)->field),                                      \
        .bytes = sizeof(((aggregate *)0)->field), __VA_ARGS__                                      \
    }

struct pen_param_table {
    const struct pen_param *rows;
    uint32_t count;
};
#define PEN_TABLE(array) ((struct pen_param_table){(array), sizeof(array) / sizeof((array)[0])})

/* Writes every row's default into `object`. */
void pen_params_default(struct pen_param_table table, void *object);

/* True when `row` is automatic and still waits for a value. */
bool pen_param_is_auto(const struct pen_param *row, const void *object);

/* True when the row takes fractions. */
bool pen_param_is_real(const struct pen_param *row);

/* True when `row` holds its word. */
bool pen_param_is_word(const struct pen_param *row, const void *object);

/* Stores the row's word when `text` is it; false otherwise. */
bool pen_param_store_word(const struct pen_param *row, void *object, const char *text);

/* The row called `name`, or NULL. */
const struct pen_param *pen_param_find(struct pen_param_table table, const char *name);

/* Checks and stores one value. `values` holds row->count finite doubles (an enumeration: the index,
 * a flag: 0 or 1). Errors: PEN_INVALID with `pointer`, when a value is NaN, infinite, not
 * whole where it must be, or out of range. */
bool pen_param_store(const struct pen_param *row, void *object, const double *values,
    const char *pointer, struct pen_error *error);

/* The same for a text. One that is too long is cut where a character of UTF-8 ends; control
 * characters are refused. */
bool pen_param_store_text(const struct pen_param *row, void *object, const char *text,
    const char *pointer, struct pen_error *error);
const char *pen_param_load_text(const struct pen_param *row, const void *object);

/* Component i of the row's value, which is no text, in `object`. */
double pen_param_load(const struct pen_param *row, const void *object, uint32_t i);

/* As pen_param_store, from text ("32", "on", "quadtree", "1,2.5,0"): query strings and flags. */
bool pen_param_parse(const struct pen_param *row, void *object, const char *text,
    const char *pointer, struct pen_error *error);

/* Index of `name` in a NULL-terminated list, or -1. */
int pen_choice_index(const char *const *choices, const char *name);
