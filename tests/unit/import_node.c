/* The node hierarchy, instances, lights and cameras, against transforms worked out by hand. */
#include "tests/unit/import_support.h"

#define START "{\"asset\":{\"version\":\"2.0\"},\"scene\":0,"
/* A triangle (0,0,0) (1,0,0) (0,1,0) as mesh 0. */
#define MESH                                                                                       \
    "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0}}]}],"                           \
    "\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":3,\"type\":\"VEC3\"}],"     \
    "\"bufferViews\":[{\"buffer\":0,\"byteLength\":36}],\"buffers\":[{\"byteLength\":36,\"uri\":"  \
    "\""                                                                                           \
    "data:application/gltf-buffer;base64,"                                                         \
    "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA\"}]}"
#define HALF "0.7071067811865476" /* sine and cosine of 45 degrees: a quarter turn */

static void hierarchy(void)
{
    /* A quarter turn around z and a shift by 10 along x; below it, doubled and up by 3. */
    struct imported r = import_json(
        START "\"scenes\":[{\"nodes\":[0]}],\"nodes\":["
              "{\"translation\":[10,0,0],\"rotation\":[0,0," HALF "," HALF "],\"children\":[1,2]},"
              "{\"translation\":[0,3,0],\"scale\":[2,2,2],\"mesh\":0},"
              "{\"matrix\":[0,1,0,0, -1,0,0,0, 0,0,1,0, 7,8,9,1],\"mesh\":0}]," MESH);
    CHECK(r.ok && r.scene.instance_count == 2 && r.scene.primitive_count == 1);
    /* (x,y) -> child (2x, 2y+3) -> turned (-(2y+3), 2x) -> (10-2y-3, 2x) */
    CHECK(r.ok && draws(&r.scene, V(7, 0, 0), V(7, 2, 0), V(5, 0, 0)));
    /* the matrix turns (x,y) to (-y+7, x+8, 9); turned again: (-(x+8)+10, -y+7, 9) */
    CHECK(r.ok && draws(&r.scene, V(2, 7, 9), V(1, 7, 9), V(2, 6, 9)));
    CHECK(r.ok && fabsf(r.scene.header->bounds_min[0] - 1) < 1e-5f &&
          fabsf(r.scene.header->bounds_max[2] - 9) < 1e-5f);
    imported_free(&r);

    r = import_json(START "\"scenes\":[{\"nodes\":[0]}],\"nodes\":["
                          "{\"scale\":[-1,1,1],\"mesh\":0}]," MESH);
    CHECK(r.ok && r.scene.instances[0].flags == PSC_MIRRORED);
    imported_free(&r);

    /* Without scenes, every node that is nobody's child is drawn. */
    r = import_json("{\"asset\":{\"version\":\"2.0\"},\"nodes\":[{\"mesh\":0},{\"children\":[0]},"
                    "{\"mesh\":0}]," MESH);
    CHECK(r.ok && r.scene.instance_count == 2);
    imported_free(&r);

    r = import_json(START
        "\"scenes\":[{\"nodes\":[0]},{\"nodes\":[1]}],\"nodes\":[{\"mesh\":0},"
        "{\"mesh\":0,\"skin\":0}],\"skins\":[{\"joints\":[0]}],\"animations\":[{\"channels\":[],"
        "\"samplers\":[]},{\"channels\":[],\"samplers\":[]}]," MESH);
    CHECK(r.ok && r.scene.instance_count == 1 && has_warning(&r.scene, "2 scenes"));
    CHECK(r.ok && r.scene.motion.animation_count == 2);
    imported_free(&r);
}

/* Scenes that list children: each node is drawn once. */
static void listed_children(void)
{
#define SHIFTED "\"translation\":[0,0,5],\"children\":[1]}," /* node 0, the parent of 1 */
    const struct {
        const char *roots;
        uint32_t instances;
        float z; /* of node 1 */
        const char *warning;
    } cases[] = {{"[0]", 2, 6, NULL}, {"[0,1]", 2, 6, "beside its parent"},
        {"[1,0]", 2, 6, "beside its parent"}, {"[1]", 2, 1, "not its parent 0"},
        {"[2]", 1, 0, "not its parent 1"}, {"[2,0]", 2, 6, "beside its parent"},
        {"[2,1]", 2, 1, "not its parent 0"}, {"[1,1]", 2, 1, "not its parent"},
        {"[0,0]", 2, 6, "twice"}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char *json = text(START "\"scenes\":[{\"nodes\":%s}],\"nodes\":[{" SHIFTED
                                "{\"translation\":[0,0,1],\"mesh\":0,\"children\":[2]},"
                                "{\"mesh\":0}]," MESH,
            cases[i].roots);
        struct imported r = import_json(json);
        float z = cases[i].z;
        CHECK(r.ok && r.scene.instance_count == cases[i].instances);
        CHECK(r.ok && draws(&r.scene, V(0, 0, z), V(1, 0, z), V(0, 1, z)));
        CHECK(r.ok && (cases[i].warning ? has_warning(&r.scene, cases[i].warning)
                                        : !r.scene.warning_bytes));
        imported_free(&r);
        free(json);
    }
}

/* KHR_node_visibility: nothing at or below a hidden node is drawn or lit; cameras stay. */
static void visibility(void)
{
#define HIDDEN(value) "\"extensions\":{\"KHR_node_visibility\":{" value "}}"
    struct imported r = import_json(START
        "\"scenes\":[{\"nodes\":[0,3,4]}],\"extensionsRequired\":[\"KHR_node_visibility\"],"
        "\"nodes\":[{\"mesh\":0,\"children\":[1]," HIDDEN(
            "\"visible\":false") "},"
                                 "{\"mesh\":0,\"camera\":0,\"children\":[2]," HIDDEN(
                                     "\"visible\":true") "},"
                                                         "{\"extensions\":{\"KHR_lights_punctual\":"
                                                         "{\"light\":0}}},"
                                                         "{\"mesh\":0,\"translation\":[3,0,0]"
                                                         "," HIDDEN(
                                                             "") "},"
                                                                 "{\"mesh\":0,\"translation\":[0,7,"
                                                                 "0]," HIDDEN(
                                                                     "\"visible\":true") "}],"
                                                                                         "\"cameras"
                                                                                         "\":[{"
                                                                                         "\"type\":"
                                                                                         "\"perspec"
                                                                                         "tive\","
                                                                                         "\"perspec"
                                                                                         "tive\":{"
                                                                                         "\"yfov\":"
                                                                                         "1,"
                                                                                         "\"znear\""
                                                                                         ":1}}],"
                                                                                         "\"extensi"
                                                                                         "ons\":{"
                                                                                         "\"KHR_"
                                                                                         "lights_"
                                                                                         "punctual"
                                                                                         "\":{"
                                                                                         "\"lights"
                                                                                         "\":[{"
                                                                                         "\"type\":"
                                                                                         "\"point\""
                                                                                         "}]}}"
                                                                                         "," MESH);
    CHECK(r.ok && r.scene.instance_count == 2 && r.scene.light_count == 0);
    CHECK(r.ok && r.scene.camera_count == 1 && !r.scene.warning_bytes);
    CHECK(r.ok && draws(&r.scene, V(3, 0, 0), V(4, 0, 0), V(3, 1, 0)));
    CHECK(r.ok && draws(&r.scene, V(0, 7, 0), V(1, 7, 0), V(0, 8, 0)));
    CHECK(r.ok && r.scene.header->bounds_max[1] == 8 && r.scene.header->bounds_min[1] == 0);
    imported_free(&r);
    r = import_json(START "\"scenes\":[{}],\"nodes\":[{" HIDDEN("\"visible\":0") "}]," MESH);
    CHECK(!r.ok && !strcmp(r.error.pointer, "/nodes/0/extensions/KHR_node_visibility/visible"));
    imported_free(&r);
}

static void gpu_instancing(void)
{
    struct {
        float p[9], t[6];
    } buffer = {{0, 0, 0, 1, 0, 0, 0, 1, 0}, {0, 0, 1, 0, 0, 2}};
    char *json = text(START
        "\"scenes\":[{\"nodes\":[0]}],\"nodes\":[{\"translation\":[5,0,0],\"mesh\":0,"
        "\"extensions\":{\"EXT_mesh_gpu_instancing\":{\"attributes\":{\"TRANSLATION\":1}}}}],"
        "\"extensionsRequired\":[\"EXT_mesh_gpu_instancing\"],"
        "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0}}]}],"
        "\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":3,\"type\":\"VEC3\"},"
        "{\"bufferView\":0,\"byteOffset\":36,\"componentType\":5126,\"count\":2,"
        "\"type\":\"VEC3\"}],"
        "\"bufferViews\":[{\"buffer\":0,\"byteLength\":60}],"
        "\"buffers\":[{\"byteLength\":60,\"uri\":\"data:;base64,%s\"}]}",
        base64(&buffer, sizeof buffer));
    struct imported r = import_json(json);
    CHECK(r.ok && r.scene.instance_count == 2 && r.scene.primitive_count == 1);
    CHECK(r.ok && draws(&r.scene, V(5, 0, 2), V(6, 0, 2), V(5, 1, 2)));
    imported_free(&r);
    free(json);
}

/* The numbers are those that Blender 3.6 and later export for a 100 W point lamp, a 50 W spot and a
 * sun of strength 3: W / (4 pi) x 683 in candela, W/m^2 x 683 in lux. */
static void lights(void)
{
    struct imported r = import_json(
        START "\"scenes\":[{\"nodes\":[0,1,2,3,4]}],\"nodes\":["
              "{\"name\":\"Lamp\",\"translation\":[1,2,3],"
              "\"extensions\":{\"KHR_lights_punctual\":{\"light\":0}}},"
              /* turned by -90 degrees around x: shines down */
              "{\"translation\":[0,5,0],\"rotation\":[-" HALF ",0,0," HALF "],"
              "\"extensions\":{\"KHR_lights_punctual\":{\"light\":1}}},"
              "{\"translation\":[0,5,0],\"rotation\":[-" HALF ",0,0," HALF "],"
              "\"extensions\":{\"KHR_lights_punctual\":{\"light\":2}}},"
              "{\"scale\":[2,2,2],\"extensions\":{\"EXT_lights_area\":{\"light\":0}}},"
              "{\"extensions\":{\"EXT_lights_area\":{\"light\":1}}}],"
              "\"extensions\":{\"KHR_lights_punctual\":{\"lights\":["
              "{\"type\":\"point\",\"intensity\":5435.1413,\"color\":[1,0.5,0.25]},"
              "{\"type\":\"spot\",\"intensity\":2717.5706,\"name\":\"Spot\",\"spot\":{"
              "\"innerConeAngle\":0.2617993878,\"outerConeAngle\":0.5235987756}},"
              "{\"type\":\"directional\",\"intensity\":2049}]},"
              "\"EXT_lights_area\":{\"lights\":["
              "{\"type\":\"rect\",\"intensity\":6830,\"size\":0.5,\"rect\":{\"aspect\":3}},"
              "{\"type\":\"disk\",\"intensity\":683,\"size\":0.5}]}}}");
    CHECK(r.ok && r.scene.light_count == 5);
    if (!r.ok || r.scene.light_count != 5)
        return;
    const struct pen_light *l = &r.scene.lights[0].light;
    CHECK_STR(r.scene.lights[0].name, "Lamp");
    CHECK(l->type == PEN_LIGHT_POINT);
    CHECK_NEAR(l->power_w, 100, 0.01);
    CHECK_NEAR(l->position[1], 2, 0);
    CHECK_NEAR(l->color[2], 0.25, 0);
    l = &r.scene.lights[1].light;
    CHECK_STR(r.scene.lights[1].name, "Spot");
    CHECK(l->type == PEN_LIGHT_SPOT);
    /* 50 W / 4 pi on the axis, times the solid angle 2 pi (1 - (cos 15 + cos 30) / 2) */
    CHECK_NEAR(l->power_w, 50 / (4 * M_PI) * 0.5279408, 1e-4);
    CHECK_NEAR(l->inner_cone_deg, 15, 1e-4);
    CHECK_NEAR(l->outer_cone_deg, 30, 1e-4);
    CHECK_NEAR(l->target[1] - l->position[1], -1, 1e-6);
    CHECK_NEAR(l->target[0] - l->position[0], 0, 1e-6);
    l = &r.scene.lights[2].light;
    CHECK(l->type == PEN_LIGHT_SUN);
    CHECK_NEAR(l->irradiance, 3, 1e-4);
    CHECK_NEAR(l->target[1] - l->position[1], -1, 1e-6);
    l = &r.scene.lights[3].light;
    CHECK(l->type == PEN_LIGHT_RECT);
    CHECK_NEAR(l->width, 3, 1e-6);
    CHECK_NEAR(l->height, 1, 1e-6);
    CHECK_NEAR(l->radiance, 10, 1e-4);
    CHECK_NEAR(l->power_w, 0, 0);
    CHECK_NEAR(l->target[2] - l->position[2], -1, 1e-6);
    CHECK_NEAR(l->up[1], 1, 1e-6);
    l = &r.scene.lights[4].light;
    CHECK(l->type == PEN_LIGHT_DISK);
    CHECK_NEAR(l->radius, 0.25, 1e-6);
    CHECK_NEAR(l->radiance, 1, 1e-5);
    CHECK(!has_warning(&r.scene, "cd"));
    imported_free(&r);

    r = import_json(
        START "\"scenes\":[{\"nodes\":[0]}],\"nodes\":[{\"extensions\":{"
              "\"KHR_lights_punctual\":{\"light\":0}}}],\"extensions\":{\"KHR_lights_punctual\":{"
              "\"lights\":[{\"type\":\"point\"}]}}}"); /* the default is 1 cd */
    CHECK(r.ok && !has_warning(&r.scene, "cd"));
    CHECK(r.ok && fabs(r.scene.lights[0].light.power_w - 4 * M_PI / 683) < 1e-6);
    imported_free(&r);
}

static void cameras(void)
{
    /* Turned by a quarter around y: looks along -x. Bounds' centre (0.5, 0.5, 0). */
    struct imported r = import_json(
        START "\"scenes\":[{\"nodes\":[0,1,2]}],\"nodes\":["
              "{\"camera\":0,\"name\":\"Shot \xc3\xa9\",\"translation\":[4.5,0.5,0],"
              "\"rotation\":[0," HALF ",0," HALF "]},{\"mesh\":0},"
              "{\"camera\":1,\"translation\":[0.5,0.5,10]}],"
              "\"cameras\":[{\"type\":\"perspective\",\"perspective\":{\"yfov\":0.7853981634,"
              "\"znear\":0.1}},{\"type\":\"orthographic\",\"orthographic\":{\"xmag\":2,\"ymag\":2,"
              "\"znear\":0.1,\"zfar\":100}}]," MESH);
    CHECK(r.ok && r.scene.camera_count == 2);
    if (!r.ok || r.scene.camera_count != 2)
        return;
    const struct psc_camera *c = &r.scene.cameras[0];
    CHECK_STR(c->name, "Shot \xc3\xa9");
    CHECK_NEAR(c->fov_y_deg, 45, 1e-4);
    CHECK_NEAR(c->eye[0], 4.5, 1e-6);
    CHECK_NEAR(c->target[0], 0.5, 1e-5); /* as far ahead as the middle of the scene */
    CHECK_NEAR(c->target[1], 0.5, 1e-5);
    CHECK_NEAR(c->up[1], 1, 1e-6);
    c = &r.scene.cameras[1]; /* 2 m half height at the focus, seen under 5 degrees */
    double distance = 2 / tan(5 * M_PI / 180);
    CHECK_NEAR(c->fov_y_deg, 10, 1e-6);
    CHECK_NEAR(c->eye[2], distance, 1e-4);
    CHECK_NEAR(c->target[2], 0, 1e-4);
    CHECK(has_warning(&r.scene, "Orthographic"));
    imported_free(&r);
}

int main(void)
{
    hierarchy();
    listed_children();
    visibility();
    gpu_instancing();
    lights();
    cameras();
    CHECK_DONE();
}
