/* The properties of a glTF 2.0 document that the importer or tinygltf reads, as data. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

/* clang-format off */
enum schema_array_id {
    IN_BUFFERS, IN_VIEWS, IN_ACCESSORS, IN_MESHES, IN_NODES, IN_SCENES, IN_MATERIALS, IN_TEXTURES,
    IN_IMAGES, IN_SAMPLERS, IN_CAMERAS, IN_SKINS, IN_LIGHTS, IN_AREA_LIGHTS, IN_VARIANTS,
    SCHEMA_ARRAYS
};
/* clang-format on */

struct schema_array {
    const char *key;
    uint32_t most;
    const char *extension; /* NULL: at the root */
};

enum field_kind {
    INDEX,      /* into array `into` */
    UINT,       /* min to max; max 0: up to 2^31 - 1 */
    NUMBER,     /* finite in single precision */
    NUMBERS,    /* an array of `max` of them; max 0: of any number */
    INDICES,    /* an array of INDEX */
    INDEX_MAP,  /* an object whose members are INDEX */
    INDEX_MAPS, /* an array of INDEX_MAP */
    UINT_MAP,   /* an object whose members are UINT */
    STRING,
    STRINGS,
    BOOL,
    OBJECT,
    OBJECTS,  /* an array of OBJECT */
    ANYTHING, /* kept as it is */
};

struct field {
    const char *key;
    enum field_kind kind;
    bool required;
    bool dispensable; /* a value out of range is passed over */
    enum schema_array_id into;
    uint32_t min, max;
    const struct schema *schema;
};

struct schema {
    const struct field *fields;
    uint32_t count; /* at most 32 */
};

extern const struct schema schema_root;
extern const struct schema_array schema_arrays[SCHEMA_ARRAYS];
