/* What one upload may ask for. Chosen so that an import that keeps to them fits in the 2 GiB and
 * the 60 s that the importer is given by default, and so that a lie about a size is refused from
 * the header that tells it, before anything is allocated. */
#pragma once

#define IMP_MAX_JSON_BYTES (512u << 20) /* data URIs count */
#define IMP_MAX_JSON_DEPTH 64
#define IMP_MAX_JSON_VALUES 10000000u /* about 100 bytes each */

#define IMP_MAX_ZIP_BYTES (1ull << 30)       /* unpacked, all entries together */
#define IMP_MAX_ZIP_RATIO 200                /* unpacked to packed, of a zip that unpacks to ... */
#define IMP_ZIP_RATIO_FROM_BYTES (16u << 20) /* ... more than this */

#define IMP_MAX_NODES 1000000u
#define IMP_MAX_NODE_DEPTH 1024u
#define IMP_MAX_INSTANCES 1000000u /* uses of a primitive */
#define IMP_MAX_PRIMITIVES 262144u
#define IMP_MAX_ITEMS 524288u /* of each other array of the document */
#define IMP_MAX_MATERIALS 65536u
#define IMP_MAX_VARIANTS 4096u
#define IMP_MAX_LIGHTS 1024u /* uses of a light; of a camera likewise */
/* After strips and fans are unrolled, all primitives together. */
#define IMP_MAX_INDICES 96000000ull
#define IMP_MAX_VERTICES 16000000ull /* used by some index, all primitives together */
#define IMP_MAX_ACCESSOR 96000000u   /* elements of one POSITION accessor, used or not */
/* Of the solids that points and lines become; beyond it those are simpler, then fewer. */
#define IMP_MAX_MARK_VERTICES 6000000ull
/* See optimise.c; a plain mesh takes 36 per corner. */
#define IMP_MAX_OPTIMISER_WORK 8000000000ull
#define IMP_MAX_MESHOPT_BYTES (512ull << 20) /* unpacked, all views together */

#define IMP_MAX_DRACO_BYTES (1024ull << 20) /* unpacked, all attributes together */

#define IMP_MAX_JOINTS 65536u /* of one skin: what a vertex can name */
#define IMP_MAX_TOTAL_JOINTS 1000000u
#define IMP_MAX_DEFORMING 4000000ull      /* vertices with a skin or morph targets */
#define IMP_MAX_MORPH_TARGETS 400000u     /* of all primitives that are drawn */
#define IMP_MAX_MORPH_VALUES 128000000ull /* their vertices, moved or not */
#define IMP_MAX_DELTAS 8000000ull         /* those that are moved; 40 bytes each */
#define IMP_MAX_ANIMATIONS 16384u
#define IMP_MAX_CHANNELS 262144u /* of all animations; of samplers likewise */
#define IMP_MAX_KEYS 16000000ull /* numbers in all keys */

#define IMP_MAX_IMAGES 4096u
#define IMP_MAX_IMAGE_PIXELS (64ull << 20)  /* px, one image */
#define IMP_MAX_TOTAL_PIXELS (256ull << 20) /* px, all images as uploaded */
#define IMP_KEEP_TOTAL_PIXELS (96ull << 20) /* px; beyond it the largest images are halved */
#define IMP_MAX_IMAGE_SIDE 16384u           /* px, as in the blob; larger ones are halved */

#define IMP_MAX_WARNINGS 64
