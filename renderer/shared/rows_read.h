/* Reads SHARED_ROWS. Rows that the reader has not defined say nothing to it; afterwards none is. */
#ifndef ENUM
#define ENUM(tag)
#endif
#ifndef ITEM
#define ITEM(name)
#endif
#ifndef ITEM_AT
#define ITEM_AT(name, value)
#endif
#ifndef UITEM
#define UITEM(name)
#endif
#ifndef UITEM_AT
#define UITEM_AT(name, value)
#endif
#ifndef END_ENUM
#define END_ENUM
#endif
#ifndef KNOWN
#define KNOWN(name)
#endif
#ifndef USES
#define USES(file)
#endif
#ifndef UNIFORM_BLOCK
#define UNIFORM_BLOCK(tag, Name, binding)
#endif
#ifndef STORAGE_BLOCK
#define STORAGE_BLOCK(tag, Name, binding, access)
#endif
#ifndef END_BLOCK
#define END_BLOCK(instance)
#endif
#ifndef STORAGE_ARRAY
#define STORAGE_ARRAY(Name, binding, access, Type, name)
#endif
#ifndef STRUCT
#define STRUCT(tag, Name)
#endif
#ifndef STORAGE_STRUCT
#define STORAGE_STRUCT(tag, Name)
#endif
#ifndef END_STRUCT
#define END_STRUCT
#endif
#ifndef FIELD
#define FIELD(type, name)
#endif
#ifndef ARRAY
#define ARRAY(type, name, count)
#endif
#ifndef STRUCT_ARRAY
#define STRUCT_ARRAY(tag, Name, name, count)
#endif
#ifndef PEN_LIGHT_TYPE
#define PEN_LIGHT_TYPE(name, text)
#endif
#ifndef PEN_TONE_MAP
#define PEN_TONE_MAP(name, text, curve)
#endif

#include SHARED_ROWS

#undef ENUM
#undef ITEM
#undef ITEM_AT
#undef UITEM
#undef UITEM_AT
#undef END_ENUM
#undef KNOWN
#undef USES
#undef UNIFORM_BLOCK
#undef STORAGE_BLOCK
#undef END_BLOCK
#undef STORAGE_ARRAY
#undef STRUCT
#undef STORAGE_STRUCT
#undef END_STRUCT
#undef FIELD
#undef ARRAY
#undef STRUCT_ARRAY
#undef PEN_LIGHT_TYPE
#undef PEN_TONE_MAP
#undef PEN_TONE_FUNCTION
#undef PEN_TONE_FUNCTION_END
