/* What the maps of a picture are too coarse for, said in its warnings. */
#pragma once
#include "renderer/technique.h"

/* After the method recorded a face of a light. Compares the texels of run->bound's map with the
 * picture's pixels where the camera looks. True: it warned. */
bool frame_warn_of_resolution(const struct technique_run *run);
