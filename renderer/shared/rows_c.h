/* What C and GLSL share (blocks, enumerations, binding numbers) is written once, as rows of a .def
 * file, and this is how C reads it:
 *
 *     #define SHARED_ROWS "renderer/shaders/frame/view.def"
 *     #include "renderer/shared/rows_c.h"
 *
 * A shader reads the same rows through `#include "view.def"`. They are
 *
 *   ENUM(tag) ITEM(name) ITEM_AT(name, value) UITEM(name) UITEM_AT(name, value) END_ENUM
 *       An enumeration; in GLSL each item is a macro, of U items an unsigned one. The tag may be
 *       left out.
 *   KNOWN(name)
 *       A number that C has from a header which the file includes, for GLSL.
 *   USES(file)
 *       GLSL needs what that other file of rows defines; C includes it, or its header, before.
 *   UNIFORM_BLOCK(tag, Name, binding) fields END_BLOCK(instance)
 *   STORAGE_BLOCK(tag, Name, binding, access) fields END_BLOCK(instance)
 *       struct tag, and a block in the layout std140 or std430.
 *   STORAGE_ARRAY(Name, binding, access, Type, name)
 *       A storage block that is an array of any length; none of C's.
 *   STRUCT(tag, Name) fields END_STRUCT
 *   STORAGE_STRUCT(tag, Name) fields END_STRUCT
 *       What uniform and storage blocks have arrays of.
 *   FIELD(type, name) ARRAY(type, name, count) STRUCT_ARRAY(tag, Name, name, count)
 *       Of a block or structure. Types: float, int, uint, vec2, vec3, vec4, ivec2, ivec4, uvec2,
 *       uvec4, mat4. The struct is laid out as GLSL wants it, with gaps where GLSL has gaps. */
#include <stddef.h>
#include <stdint.h>

#ifndef SHARED_MEMBER_float
#define SHARED_MEMBER_float(name) float name
#define SHARED_MEMBER_int(name) int32_t name
#define SHARED_MEMBER_uint(name) uint32_t name
#define SHARED_MEMBER_vec2(name) _Alignas(8) float name[2]
#define SHARED_MEMBER_ivec2(name) _Alignas(8) int32_t name[2]
#define SHARED_MEMBER_uvec2(name) _Alignas(8) uint32_t name[2]
#define SHARED_MEMBER_vec3(name) _Alignas(16) float name[3]
#define SHARED_MEMBER_vec4(name) _Alignas(16) float name[4]
#define SHARED_MEMBER_ivec4(name) _Alignas(16) int32_t name[4]
#define SHARED_MEMBER_uvec4(name) _Alignas(16) uint32_t name[4]
#define SHARED_MEMBER_mat4(name) _Alignas(16) float name[4][4]

/* OpenGL 4.6, 7.6.2.2: what these take, and what their offset is a multiple of. */
#define SHARED_RULE_float(X) X(4, 4)
#define SHARED_RULE_int(X) X(4, 4)
#define SHARED_RULE_uint(X) X(4, 4)
#define SHARED_RULE_vec2(X) X(8, 8)
#define SHARED_RULE_ivec2(X) X(8, 8)
#define SHARED_RULE_uvec2(X) X(8, 8)
#define SHARED_RULE_vec3(X) X(12, 16)
#define SHARED_RULE_vec4(X) X(16, 16)
#define SHARED_RULE_ivec4(X) X(16, 16)
#define SHARED_RULE_uvec4(X) X(16, 16)
#define SHARED_RULE_mat4(X) X(64, 16)
#define SHARED_SIZE(size, align) (size)
#define SHARED_ALIGN(size, align) (align)
#endif

/* The structures. */
#define ENUM(tag) enum tag {
#define ITEM(name) name,
#define ITEM_AT(name, value) name = (value),
#define UITEM(name) name,
#define UITEM_AT(name, value) name = (value),
#define END_ENUM                                                                                   \
    }                                                                                              \
    ;
#define UNIFORM_BLOCK(tag, Name, binding) struct __attribute__((aligned(16))) tag {
#define STORAGE_BLOCK(tag, Name, binding, access) struct tag {
#define END_BLOCK(instance)                                                                        \
    }                                                                                              \
    ;
#define STRUCT(tag, Name) struct __attribute__((aligned(16))) tag {
#define STORAGE_STRUCT(tag, Name) struct tag {
#define END_STRUCT                                                                                 \
    }                                                                                              \
    ;
#define FIELD(type, name) SHARED_MEMBER_##type(name);
#define ARRAY(type, name, count) SHARED_MEMBER_##type(name[count]);
#define STRUCT_ARRAY(tag, Name, name, count) struct tag name[count];
#include "renderer/shared/rows_read.h"

/* The same as bytes, placed by OpenGL's rule alone. */
#define UNIFORM_BLOCK(tag, Name, binding) struct __attribute__((aligned(16))) tag##_by_rule {
#define STORAGE_BLOCK(tag, Name, binding, access) struct tag##_by_rule {
#define END_BLOCK(instance)                                                                        \
    }                                                                                              \
    ;
#define STRUCT(tag, Name) struct __attribute__((aligned(16))) tag##_by_rule {
#define STORAGE_STRUCT(tag, Name) struct tag##_by_rule {
#define END_STRUCT                                                                                 \
    }                                                                                              \
    ;
#define FIELD(type, name)                                                                          \
    _Alignas(SHARED_RULE_##type(SHARED_ALIGN)) char name[SHARED_RULE_##type(SHARED_SIZE)];
#define ARRAY(type, name, count)                                                                   \
    _Alignas(SHARED_RULE_##type(SHARED_ALIGN)) char name[SHARED_RULE_##type(SHARED_SIZE) * (count)];
#define STRUCT_ARRAY(tag, Name, name, count)                                                       \
    _Alignas(struct tag##_by_rule) char name[sizeof(struct tag##_by_rule) * (count)];
#include "renderer/shared/rows_read.h"

/* That both agree. An array's stride in std140 is a multiple of 16. */
#define SHARED_CHECK(tag, stride_rule)                                                             \
    __attribute__((unused)) static inline void shared_check_##tag(void)                            \
    {                                                                                              \
        typedef struct tag real;                                                                   \
        typedef struct tag##_by_rule rule;                                                         \
        enum { stride = stride_rule };                                                             \
        _Static_assert(sizeof(real) == sizeof(rule) && stride > 0, "size of " #tag);
#define UNIFORM_BLOCK(tag, Name, binding) SHARED_CHECK(tag, 16)
#define STORAGE_BLOCK(tag, Name, binding, access) SHARED_CHECK(tag, 4)
#define END_BLOCK(instance) }
#define STRUCT(tag, Name) SHARED_CHECK(tag, 16)
#define STORAGE_STRUCT(tag, Name) SHARED_CHECK(tag, 4)
#define END_STRUCT }
#define SHARED_SAME(name)                                                                          \
    _Static_assert(offsetof(real, name) == offsetof(rule, name) &&                                 \
                       sizeof(((real *)0)->name) == sizeof(((rule *)0)->name),                     \
        "place of " #name);
#define FIELD(type, name) SHARED_SAME(name)
#define ARRAY(type, name, count)                                                                   \
    SHARED_SAME(name)                                                                              \
    _Static_assert(SHARED_RULE_##type(SHARED_SIZE) % stride == 0 &&                                \
                       SHARED_RULE_##type(SHARED_SIZE) % SHARED_RULE_##type(SHARED_ALIGN) == 0,    \
        "stride of " #name);
#define STRUCT_ARRAY(tag, Name, name, count)                                                       \
    SHARED_SAME(name) _Static_assert(sizeof(struct tag) % stride == 0, "stride of " #name);
#include "renderer/shared/rows_read.h"
#undef SHARED_CHECK
#undef SHARED_SAME
#undef SHARED_ROWS
