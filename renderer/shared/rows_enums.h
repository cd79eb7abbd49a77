/* The enumerations of SHARED_ROWS (rows_c.h) alone. */
#define ENUM(tag) enum tag {
#define ITEM(name) name,
#define ITEM_AT(name, value) name = (value),
#define UITEM(name) name,
#define UITEM_AT(name, value) name = (value),
#define END_ENUM                                                                                   \
    }                                                                                              \
    ;
#include "renderer/shared/rows_read.h"
