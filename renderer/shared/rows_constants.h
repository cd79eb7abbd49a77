/* The numbers of SHARED_ROWS (rows_c.h): initialisers of struct gl_constant. Rows of the protocol,
 * whose enumerations C has from its headers, are read too. */
#define ITEM(name) {#name, name, 0},
#define ITEM_AT(name, value) {#name, name, 0},
#define UITEM(name) {#name, name, 1},
#define UITEM_AT(name, value) {#name, name, 1},
#define KNOWN(name) {#name, name, 0},
#define PEN_LIGHT_TYPE(name, text) {"PEN_LIGHT_" #name, PEN_LIGHT_##name, 0},
#define PEN_TONE_MAP(name, text, curve) {"PEN_TONE_" #name, PEN_TONE_##name, 0},
#include "renderer/shared/rows_read.h"
