#include "renderer/device.h"
#include <stddef.h>

const char *const pen_device_choice_names[] = {"auto", "gpu", "surfaceless", "osmesa", NULL};
