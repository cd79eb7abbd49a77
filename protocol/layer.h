/* The layers of an image: one row of layers.def each, from which the enumeration, the checks, the
 * documents, the channels of files and the passes that draw them are derived. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

enum pen_layer {
#define LAYER(id, ...) PEN_LAYER_##id,
#include "protocol/layers.def"
#undef LAYER
    PEN_LAYER_ALL, /* EXR only: all that the method has of the above, in one file */
    PEN_LAYERS
};

/* Letters of the channels in a file that names them. */
enum pen_layer_channels {
    PEN_CHANNELS_RGB,
    PEN_CHANNELS_RGBA, /* RGB in files of 8 bits */
    PEN_CHANNELS_XYZ,  /* RGB when it is alone in its file */
    PEN_CHANNELS_Y,
    PEN_CHANNELS_Z
};

enum pen_layer_source {
    PEN_SOURCE_GBUFFER,    /* nothing but surfaces: no method runs */
    PEN_SOURCE_BEAUTY,     /* the sum of shaded frames */
    PEN_SOURCE_VISIBILITY, /* the sum of the lights' visibility */
    PEN_SOURCE_CLASSES,    /* counts of what the classifier proved */
    PEN_SOURCE_VARIANCE,   /* of methods that estimate their error */
    PEN_SOURCES
};

struct pen_layer_info {
    const char *name, *unit, *help; /* unit: "" for none */
    uint8_t channels, source;       /* enum pen_layer_channels, enum pen_layer_source */
};
extern const struct pen_layer_info pen_layers[PEN_LAYER_ALL];
extern const char *const pen_layer_names[]; /* with "all"; NULL-terminated */

/* The row called `name`, or NULL. */
const struct pen_layer_info *pen_layer_find(const char *name);
bool pen_layer_is_metres(const struct pen_layer_info *layer);
