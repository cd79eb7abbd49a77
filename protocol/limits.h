/* Limits that several layers must agree on. */
#pragma once

#define PEN_MAX_LIGHTS 8
#define PEN_TECHNIQUE_PARAM_BYTES 256
#define PEN_TECHNIQUE_NAME_BYTES 32
#define PEN_NAME_BYTES 60                /* of what a scene names, with the zero at its end */
#define PEN_MAX_IMAGE_SIDE 8192          /* px */
#define PEN_MAX_IMAGE_PIXELS (16u << 20) /* px per image, before antialiasing */
#define PEN_MAX_ANTIALIAS 64             /* jittered frames */
#define PEN_MAX_PASSES 96
#define PEN_MAX_WARNINGS 8
#define PEN_ID_BYTES 32 /* SHA-256 */
#define PEN_ID_HEX 64
#define PEN_ID_PREFIX 6          /* fewest digits that may stand for a whole id */
#define PEN_LABEL_NAME_BYTES 128 /* of what a scene is called, with the zero at its end */
#define PEN_LABEL_TAG_BYTES 40
#define PEN_LABEL_TAGS 16
#define PEN_MAX_JSON_BYTES (64 << 10)
#define PEN_MAX_JSON_DEPTH 32
#define PEN_MAX_UPLOAD_BYTES (1ull << 30)
