#include "protocol/layer.h"
#include <stddef.h>
#include <string.h>

const struct pen_layer_info pen_layers[PEN_LAYER_ALL] = {
#define LAYER(id, name, channels, unit, source, help)                                              \
    {#name, unit, help, PEN_CHANNELS_##channels, PEN_SOURCE_##source},
#include "protocol/layers.def"
#undef LAYER
};

const char *const pen_layer_names[] = {
#define LAYER(id, name, ...) #name,
#include "protocol/layers.def"
#undef LAYER
    "all", NULL};

const struct pen_layer_info *pen_layer_find(const char *name)
{
    for (uint32_t i = 0; i < PEN_LAYER_ALL; i++)
        if (!strcmp(pen_layers[i].name, name))
            return &pen_layers[i];
    return NULL;
}

bool pen_layer_is_metres(const struct pen_layer_info *layer)
{
    return !strcmp(layer->unit, "m");
}
