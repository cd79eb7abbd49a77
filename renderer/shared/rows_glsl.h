/* The blocks of SHARED_ROWS (rows_c.h) as GLSL: string literals, one after the other. */
#define USES(file) "#include \"" file "\"\n"
#define UNIFORM_BLOCK(tag, Name, binding)                                                          \
    "layout(std140, binding = " #binding ") uniform " #Name " {\n"
#define STORAGE_BLOCK(tag, Name, binding, access)                                                  \
    "layout(std430, binding = " #binding ") " #access " buffer " #Name " {\n"
#define END_BLOCK(instance) "} " #instance ";\n"
#define STORAGE_ARRAY(Name, binding, access, Type, name)                                           \
    "layout(std430, binding = " #binding ") " #access " buffer " #Name " {\n"                      \
    "    " #Type " " #name "[];\n"                                                                 \
    "};\n"
#define STRUCT(tag, Name) "struct " #Name " {\n"
#define STORAGE_STRUCT(tag, Name) "struct " #Name " {\n"
#define END_STRUCT "};\n"
#define FIELD(type, name) "    " #type " " #name ";\n"
#define ARRAY(type, name, count) "    " #type " " #name "[" #count "];\n"
#define STRUCT_ARRAY(tag, Name, name, count) "    " #Name " " #name "[" #count "];\n"
#define PEN_TONE_FUNCTION "vec3 tone_curve(int which, vec3 c, float luminance)\n{\n"
#define PEN_TONE_MAP(name, text, curve)                                                            \
    "    if (which == PEN_TONE_" #name ")\n        return " #curve ";\n"
#define PEN_TONE_FUNCTION_END "    return c;\n}\n"
#include "renderer/shared/rows_read.h"
