/* What KHR_animation_pointer moves, names of animations, visibility, and what is kept of a file's
 * motion, against values worked out by hand. Vertices: pose_compare.py. */
#include "renderer/pose/pose.h"
#include "tests/unit/import_support.h"

/* Times 0, 2; one triangle; then the values of the samplers, a float or more for each time. */
static char *animated(const char *channels, const char *samplers, const char *accessors,
    const float *values, uint32_t count, const char *rest)
{
    float buffer[64] = {0, 2, 0, 0, 0, 1, 0, 0, 0, 1, 0};
    memcpy(buffer + 11, values, count * sizeof *values);
    return text("{\"asset\":{\"version\":\"2.0\"},\"scene\":0,\"scenes\":[{\"nodes\":[0,1,2]}],"
                "\"extensionsUsed\":[\"KHR_animation_pointer\"],"
                "\"meshes\":[{\"primitives\":[{\"material\":0,\"attributes\":{\"POSITION\":1}}]}],"
                "\"animations\":[{\"name\":\"move\",\"channels\":[%s],\"samplers\":[%s]}],"
                "\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":2,"
                "\"type\":\"SCALAR\"},{\"bufferView\":0,\"byteOffset\":8,\"componentType\":5126,"
                "\"count\":3,\"type\":\"VEC3\"},%s],"
                "\"bufferViews\":[{\"buffer\":0,\"byteLength\":256}],"
                "\"buffers\":[{\"byteLength\":256,\"uri\":\"data:;base64,%s\"}],%s}",
        channels, samplers, accessors, base64(buffer, sizeof buffer), rest);
}

#define POINTER(sampler, path)                                                                     \
    "{\"sampler\":" sampler ",\"target\":{\"path\":\"pointer\",\"extensions\":{"                   \
    "\"KHR_animation_pointer\":{\"pointer\":\"" path "\"}}}}"
#define SAMPLER(output) "{\"input\":0,\"output\":" output "}"
#define ACCESSOR(offset, type)                                                                     \
    "{\"bufferView\":0,\"byteOffset\":" offset ",\"componentType\":5126,\"count\":2,"              \
    "\"type\":\"" type "\"}"
#define REST                                                                                       \
    "\"nodes\":[{\"mesh\":0},{\"extensions\":{\"KHR_lights_punctual\":{\"light\":0}}},"            \
    "{\"camera\":0}],"                                                                             \
    "\"materials\":[{\"pbrMetallicRoughness\":{\"baseColorFactor\":[1,1,1,1],"                     \
    "\"baseColorTexture\":{\"index\":0}},\"emissiveFactor\":[1,0.5,0],"                            \
    "\"extensions\":{\"KHR_materials_emissive_strength\":{\"emissiveStrength\":2}}}],"             \
    "\"textures\":[{\"source\":0}],\"images\":[{\"uri\":\"data:image/png;base64,"                  \
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mP8z8BQDwAEhQGAhKmMIQAAAABJRU5E"     \
    "rkJggg==\"}],"                                                                                \
    "\"cameras\":[{\"type\":\"perspective\",\"perspective\":{\"yfov\":0.5,\"znear\":0.1}}],"       \
    "\"extensions\":{\"KHR_lights_punctual\":{\"lights\":["                                        \
    "{\"type\":\"directional\",\"intensity\":683}]}}"

static void pointers(void)
{
    /* base colour, emissive strength, light intensity, field of view, texture offset */
    const float values[] = {1, 1, 1, 1, 0, 0.5f, 1, 0, /* */ 2, 6, /* */ 683, 2049, /* */ 0.5f,
        1.5f, /* */ 0, 0, 0.5f, -1};
    char *json =
        animated(POINTER("0", "/materials/0/pbrMetallicRoughness/baseColorFactor") "," POINTER("1",
                     "/materials/0/extensions/KHR_materials_emissive_strength/"
                     "emissiveStrength") "," POINTER("2",
                     "/extensions/KHR_lights_punctual/lights/0/intensity") "," POINTER("3",
                     "/cameras/0/perspective/yfov") "," POINTER("4",
                     "/materials/0/pbrMetallicRoughness/baseColorTexture/extensions/"
                     "KHR_texture_transform/offset") "," POINTER("1",
                     "/materials/0/name") "," POINTER("1", "/nodes/77/scale"),
            SAMPLER("2") "," SAMPLER("3") "," SAMPLER("4") "," SAMPLER("5") "," SAMPLER("6"),
            ACCESSOR("44", "VEC4") "," ACCESSOR("76", "SCALAR") "," ACCESSOR(
                "84", "SCALAR") "," ACCESSOR("92", "SCALAR") "," ACCESSOR("100", "VEC2"),
            values, sizeof values / sizeof *values, REST);
    struct imported r = import_json(json);
    free(json);
    CHECK(r.ok);
    if (!r.ok) {
        fprintf(stderr, "%s\n", r.error.message);
        return;
    }
    CHECK(has_warning(&r.scene, "Some of what the animations change"));
    struct pose *pose = pose_create(&r.scene);
    const struct psc_scene *s = pose_scene(pose);
    uint32_t changes;
    CHECK(pose_set(pose, 0, 1, &changes, NULL)); /* half way */
    CHECK(changes & POSE_MATERIALS && !(changes & (POSE_VERTICES | POSE_INSTANCES | POSE_STATE)));
    CHECK_NEAR(s->materials[0].base_color[0], 0.5, 1e-6);
    CHECK_NEAR(s->materials[0].base_color[1], 0.75, 1e-6);
    CHECK_NEAR(s->materials[0].base_color[2], 1, 1e-6);
    CHECK_NEAR(s->materials[0].base_color[3], 0.5, 1e-6);
    CHECK_NEAR(s->materials[0].emissive[0], 4, 1e-5);
    CHECK_NEAR(s->materials[0].emissive[1], 2, 1e-5);
    CHECK_NEAR(s->lights[0].light.irradiance, 2, 1e-5);
    CHECK_NEAR(s->cameras[0].fov_y_deg, 180 / M_PI, 1e-4);
    CHECK_NEAR(s->materials[0].base.transform[2], 0.25, 1e-6);
    CHECK_NEAR(s->materials[0].base.transform[5], -0.5, 1e-6);
    CHECK(pose_set(pose, -1, 0, &changes, NULL));
    CHECK(!memcmp(s->materials, r.scene.materials, r.scene.material_count * sizeof *s->materials));
    CHECK(!memcmp(s->lights, r.scene.lights, sizeof *s->lights));
    CHECK(!memcmp(s->cameras, r.scene.cameras, sizeof *s->cameras));
    pose_destroy(pose);
    imported_free(&r);
}

static void visibility(void)
{
    const float values[] = {1, 0};
    char *json = animated(POINTER("0", "/nodes/1/extensions/KHR_node_visibility/visible"),
        "{\"input\":0,\"output\":2,\"interpolation\":\"STEP\"}", ACCESSOR("44", "SCALAR"), values,
        2,
        "\"materials\":[{}],\"nodes\":[{\"mesh\":0},{\"children\":[3],\"translation\":[5,0,0]},{},"
        "{\"mesh\":0}]");
    struct imported r = import_json(json);
    free(json);
    CHECK(r.ok && r.scene.instance_count == 2 && r.scene.header->bounds_max[0] == 6);
    if (!r.ok)
        return;
    struct pose *pose = pose_create(&r.scene);
    const struct psc_scene *s = pose_scene(pose);
    uint32_t changes;
    CHECK(pose_set(pose, 0, 1.9f, &changes, NULL) && !(changes & POSE_STATE));
    CHECK(s->instance_count == 2 && s->header->triangles == 2);
    CHECK(pose_set(pose, 0, 2, &changes, NULL) && changes & POSE_STATE);
    CHECK(s->instance_count == 1 && s->header->triangles == 1 && s->header->bounds_max[0] == 1);
    CHECK(pose_set(pose, -1, 0, &changes, NULL) && changes & POSE_STATE);
    CHECK(s->instance_count == 2 && s->header->bounds_max[0] == 6);
    pose_destroy(pose);
    imported_free(&r);
}

/* Hidden in the file, and shown by the animation: mesh and light. */
static void unveiling(void)
{
    const float values[] = {0, 1};
    char *json = animated(POINTER("0", "/nodes/1/extensions/KHR_node_visibility/visible"),
        "{\"input\":0,\"output\":2,\"interpolation\":\"STEP\"}", ACCESSOR("44", "SCALAR"), values,
        2,
        "\"materials\":[{}],\"nodes\":[{\"mesh\":0},{\"children\":[3],\"translation\":[5,0,0],"
        "\"extensions\":{\"KHR_node_visibility\":{\"visible\":false}}},{},"
        "{\"mesh\":0,\"extensions\":{\"KHR_lights_punctual\":{\"light\":0}}}],"
        "\"extensions\":{\"KHR_lights_punctual\":{\"lights\":["
        "{\"type\":\"point\",\"color\":[1,0.5,0.25],\"intensity\":683}]}}");
    struct imported r = import_json(json);
    free(json);
    CHECK(r.ok && r.scene.instance_count == 2 && r.scene.header->triangles == 1 &&
          r.scene.header->bounds_max[0] == 1 && r.scene.lights[0].light.color[0] == 0);
    if (!r.ok)
        return;
    struct pose *pose = pose_create(&r.scene);
    const struct psc_scene *s = pose_scene(pose);
    uint32_t changes;
    CHECK(pose_set(pose, -1, 0, &changes, NULL));
    CHECK(s->instance_count == 1 && s->lights[0].light.color[0] == 0);
    CHECK(pose_set(pose, 0, 2, &changes, NULL) && changes & POSE_STATE);
    CHECK(s->instance_count == 2 && s->header->triangles == 2 && s->header->bounds_max[0] == 6);
    CHECK_NEAR(s->lights[0].light.color[1], 0.5, 1e-6);
    CHECK_NEAR(s->lights[0].light.position[0], 5, 1e-6);
    pose_destroy(pose);
    imported_free(&r);
}

static void names(void)
{
    struct psc_animation animations[] = {{"walk", 1.5f, 0, 0}, {"", 2, 0, 0}, {"0", 3, 0, 0}};
    struct psc_scene scene = {.motion = {.animations = animations, .animation_count = 3}};
    struct pen_error error = {0};
    int32_t found = 9;
    CHECK(pose_find(&scene, "", &found, &error) && found == -1);
    CHECK(pose_find(&scene, "walk", &found, &error) && found == 0);
    CHECK(pose_find(&scene, "1", &found, &error) && found == 1);
    CHECK(pose_find(&scene, "0", &found, &error) && found == 2); /* a name wins */
    const char *const wrong[] = {"3", "-1", "1 ", " 1", "1.0", "Walk", "99999999999999999999"};
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        CHECK(!pose_find(&scene, wrong[i], &found, &error) && error.code == PEN_INVALID);
        CHECK_STR(error.pointer, "/animation");
        CHECK(strstr(error.message, "walk, 1, 0") != NULL);
    }
    CHECK_NEAR(pose_clamp(&scene, 0, 9), 1.5, 0);
    CHECK_NEAR(pose_clamp(&scene, 0, 0.5f), 0.5, 0);
    CHECK_NEAR(pose_clamp(&scene, -1, 0.5f), 0, 0);
}

/* Without animations nothing of the motion is kept, and a skin's warning is no more. */
static void still(void)
{
    struct imported r = import_json(
        "{\"asset\":{\"version\":\"2.0\"},\"scene\":0,\"scenes\":[{\"nodes\":[0,1]}],"
        "\"nodes\":[{\"mesh\":0,\"weights\":[2]},{\"mesh\":0}],"
        "\"meshes\":[{\"weights\":[0.5],\"primitives\":[{\"attributes\":{\"POSITION\":0},"
        "\"targets\":[{\"POSITION\":0}]}]}],"
        "\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":3,\"type\":\"VEC3\"}],"
        "\"bufferViews\":[{\"buffer\":0,\"byteLength\":36}],\"buffers\":[{\"byteLength\":36,"
        "\"uri\":\"data:;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA\"}]}");
    CHECK(r.ok && r.scene.warning_bytes == 0 && r.scene.motion.deform_count == 0 &&
          r.scene.motion.bind_count == 0 && r.scene.motion.animation_count == 0);
    CHECK(r.ok && draws(&r.scene, V(0, 0, 0), V(3, 0, 0), V(0, 3, 0)));
    CHECK(r.ok && draws(&r.scene, V(0, 0, 0), V(1.5f, 0, 0), V(0, 1.5f, 0)));
    imported_free(&r);
}

int main(void)
{
    pointers();
    visibility();
    unveiling();
    names();
    still();
    CHECK_DONE();
}
