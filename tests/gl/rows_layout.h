/* The structures and blocks of SHARED_ROWS (renderer/shared/rows_c.h) as calls: what lies where in
 * C. */
#define STRUCT(tag, Name)                                                                          \
    {                                                                                              \
        typedef struct tag real;                                                                   \
        layout_structure(#Name, sizeof(real));
#define STORAGE_STRUCT(tag, Name) STRUCT(tag, Name)
#define END_STRUCT }
#define UNIFORM_BLOCK(tag, Name, binding)                                                          \
    {                                                                                              \
        typedef struct tag real;                                                                   \
        layout_block(GL_UNIFORM_BLOCK, #Name, binding, sizeof(real));
#define STORAGE_BLOCK(tag, Name, binding, access)                                                  \
    {                                                                                              \
        typedef struct tag real;                                                                   \
        layout_block(GL_SHADER_STORAGE_BLOCK, #Name, binding, sizeof(real));
#define END_BLOCK(instance)                                                                        \
    layout_end(#instance);                                                                         \
    }
#define STORAGE_ARRAY(Name, binding, access, Type, name)                                           \
    layout_block(GL_SHADER_STORAGE_BLOCK, #Name, binding, 0);                                      \
    layout_array(#name, #Type, 0, 0);                                                              \
    layout_end("");
#define FIELD(type, name) layout_field(#name, offsetof(real, name), 0);
#define ARRAY(type, name, count)                                                                   \
    layout_field(#name, offsetof(real, name), sizeof(((real *)0)->name) / (count));
#define STRUCT_ARRAY(tag, Name, name, count)                                                       \
    layout_array(#name, #Name, offsetof(real, name), sizeof(struct tag));
#include "renderer/shared/rows_read.h"
