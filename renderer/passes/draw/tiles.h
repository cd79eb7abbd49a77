/* Tiles of the image, as a classifier leaves them: RG8, class and number of receivers. */
#pragma once

#define CLASSIFY_TILE 8 /* px */
#define OPEN_TILE 4     /* of those that are looked at again: open_tiles.h */

/* enum tile_class */
#define SHARED_ROWS "renderer/shaders/screen/tile_class.def"
#include "renderer/shared/rows_c.h"
