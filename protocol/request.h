/* A render request as one plain struct. It has no pointers and no padding: it crosses processes as
 * it is, its bytes up to `delivery` are the cache key, and it is echoed back completed. */
#pragma once
#include "protocol/limits.h"
#include "protocol/layer.h"
#include "protocol/param.h"

enum pen_light_type {
#define PEN_LIGHT_TYPE(name, text) PEN_LIGHT_##name,
#include "protocol/light_types.def"
#undef PEN_LIGHT_TYPE
    PEN_LIGHT_TYPES
};
#define PEN_LIGHT_BIT(t) (1u << (t))

enum pen_light_texture { PEN_TEXTURE_NONE, PEN_TEXTURE_IMAGE, PEN_TEXTURE_PATTERN };

struct pen_light {
    double position[3]; /* m, world; the centre of the emitter (sun: only the direction counts) */
    double target[3];   /* m, world */
    uint32_t type;      /* enum pen_light_type */
    float up[3];        /* the emitter's +y is the part of `up` across its axis */
    float width;        /* m */
    float height;       /* m */
    float radius;       /* m */
    float angular_diameter_deg;
    float inner_cone_deg; /* half angles, as in KHR_lights_punctual */
    float outer_cone_deg;
    float color[3];   /* linear RGB factor */
    float power_w;    /* radiant flux, W; 0: use radiance / irradiance */
    float radiance;   /* W m^-2 sr^-1 */
    float irradiance; /* sun: W m^-2 on a surface that faces it */
    uint32_t texture; /* enum pen_light_texture */
    uint32_t pattern; /* index into pen_pattern_names when texture is PEN_TEXTURE_PATTERN */
    uint8_t image[PEN_ID_BYTES]; /* emission image when texture is PEN_TEXTURE_IMAGE */
};

enum pen_camera_mode { PEN_CAMERA_AUTO, PEN_CAMERA_LOOK_AT, PEN_CAMERA_INDEX, PEN_CAMERA_ORBIT };
#define PEN_CAMERA_BIT(m) (1u << (m))

struct pen_camera {
    double eye[3];    /* m, world */
    double target[3]; /* m, world */
    double distance;  /* orbit: m; 0: frames the bounds */
    uint32_t mode;    /* enum pen_camera_mode */
    uint32_t index;   /* of the scene's cameras */
    float up[3];
    float fov_y_deg;
    float azimuth_deg; /* orbit: from +z towards +x, around the centre of the bounds */
    float elevation_deg;
};

enum pen_format { PEN_PNG, PEN_EXR, PEN_JPEG, PEN_WEBP, PEN_TIFF, PEN_FORMATS };
enum pen_tone_map {
#define PEN_TONE_MAP(name, text, curve) PEN_TONE_##name,
#include "protocol/tone_maps.def"
#undef PEN_TONE_MAP
    PEN_TONE_MAPS
};
enum pen_edges { PEN_EDGES_SMOOTH, PEN_EDGES_NONE };
enum pen_casters { PEN_CASTERS_BOTH, PEN_CASTERS_FRONT };
enum pen_weighting { PEN_WEIGHT_AREA, PEN_WEIGHT_G };
enum pen_priority { PEN_PRIORITY_INTERACTIVE, PEN_PRIORITY_BATCH };
enum pen_on_deadline { PEN_DEADLINE_ERROR, PEN_DEADLINE_BEST };

struct pen_output {
    uint32_t format;    /* enum pen_format */
    uint32_t layer;     /* enum pen_layer */
    uint32_t bit_depth; /* 8, 16 (PNG, TIFF; EXR half), 32 (EXR float); 0: the format's default */
    uint32_t quality;   /* 1 to 100, JPEG and lossy WebP */
};

/* How the answer is wanted. No pixel of a complete picture depends on it; one that had to end before
 * its last sample says so (struct pen_progress), and is nobody else's. */
struct pen_delivery {
    uint32_t deadline_ms;
    uint32_t priority;    /* enum pen_priority */
    uint32_t on_deadline; /* enum pen_on_deadline */
    uint32_t budget_ms;   /* 0: none */
    pen_flag progressive;
    char session[PEN_NAME_BYTES]; /* of a method that goes on from the frame before, for which the
                                   * answer depends on what came before in it */
    uint32_t session_owner[2];    /* whose; filled on the way to a worker */
};

struct pen_request {
    uint8_t scene[PEN_ID_BYTES];
    char technique[PEN_TECHNIQUE_NAME_BYTES];                 /* zero-padded */
    uint32_t technique_params[PEN_TECHNIQUE_PARAM_BYTES / 4]; /* the method's own struct */
    struct pen_camera camera;
    uint32_t lights_given; /* 0: the scene's own, else one that suits the bounds */
    uint32_t light_count;
    struct pen_light lights[PEN_MAX_LIGHTS];
#define FIELD(type, name, components, ...) type name components;
#include "protocol/request.def"
#undef FIELD
    struct pen_output output;
    struct pen_delivery delivery; /* must stay last: see PEN_REQUEST_KEY_BYTES */
};
#define PEN_REQUEST_KEY_BYTES offsetof(struct pen_request, delivery)

/* m: points of requests and of files lie within; where one ends, not what is drawn well. */
#define PEN_FAR 1e9

extern const char *const pen_light_type_names[];
extern const char *const pen_format_names[];
extern const char *const pen_format_mime[];
extern const char *const pen_tone_map_names[];
extern const char *const pen_edges_names[];
extern const char *const pen_casters_names[];
extern const char *const pen_priority_names[];
extern const char *const pen_on_deadline_names[];
extern const char *const pen_pattern_names[]; /* built-in emission patterns */

/* Rows of struct pen_request, pen_camera, pen_light, pen_output and pen_delivery.
 * The object-valued keys (technique, camera, lights, output) are handled by the documents. */
struct pen_param_table pen_request_table(void);  /* base: struct pen_request */
struct pen_param_table pen_camera_table(void);   /* base: struct pen_camera; applies: modes */
struct pen_param_table pen_light_table(void);    /* base: struct pen_light; see pen_param.applies */
struct pen_param_table pen_output_table(void);   /* base: struct pen_output */
struct pen_param_table pen_delivery_table(void); /* base: struct pen_delivery */

/* Fills *request with every default (also a zeroed scene id, the first technique of the catalogue
 * that is called "pcss", else the first). */
struct pen_catalogue;
void pen_request_default(struct pen_request *request, const struct pen_catalogue *catalogue);
/* Every default of one light of `type`. */
void pen_light_default(struct pen_light *light, enum pen_light_type type);

/* True when the answer depends on what was asked before: it is kept and shared nowhere. */
bool pen_request_is_stateful(
    const struct pen_request *request, const struct pen_catalogue *catalogue);
/* True when the picture has an alpha channel: how much of a pixel the scene covers. */
bool pen_request_is_transparent(const struct pen_request *request);

/* The time it may take ends it with the picture that it has reached. */
bool pen_delivery_is_limited(const struct pen_delivery *delivery);

/* Checks what no single row can: pixel budget, layer against format, light against emitter size,
 * degenerate camera, known technique. Errors: PEN_INVALID with a pointer. A worker calls it
 * too: it trusts no message. */
struct pen_technique_info;
/* Whether it can be printed safely: its texts end and its enumerations are theirs, whatever its
 * numbers say. */
bool pen_request_is_legible(
    const struct pen_request *request, const struct pen_catalogue *catalogue);
bool pen_request_check(const struct pen_request *request, const struct pen_catalogue *catalogue,
    struct pen_error *error);

/* 64 lower-case hexadecimal digits and back; false when `text` is anything else. */
void pen_id_to_hex(const uint8_t id[PEN_ID_BYTES], char text[PEN_ID_HEX + 1]);
bool pen_id_from_hex(const char *text, uint8_t id[PEN_ID_BYTES]);
