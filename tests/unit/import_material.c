/* Materials, textures, samplers and the image decoders. */
#include "tests/unit/import_support.h"
#include <spng.h>
#include <turbojpeg.h>
#include <webp/encode.h>

#define HEAD                                                                                       \
    "{\"asset\":{\"version\":\"2.0\"},\"scene\":0,\"scenes\":[{\"nodes\":[0]}],"                   \
    "\"nodes\":[{\"mesh\":0}],"
/* A mesh with one triangle per material, its buffer being buffer 0. */
#define TRIANGLES(...)                                                                             \
    "\"meshes\":[{\"primitives\":[" __VA_ARGS__ "]}],"                                             \
    "\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":3,\"type\":\"VEC3\"}],"     \
    "\"bufferViews\":[{\"buffer\":0,\"byteLength\":36}],\"buffers\":[{\"byteLength\":36,\"uri\":"  \
    "\""                                                                                           \
    "data:application/gltf-buffer;base64,"                                                         \
    "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA\"}]"
#define TRIANGLE(material) "{\"attributes\":{\"POSITION\":0},\"material\":" material "}"

struct bytes {
    uint8_t *data;
    size_t bytes;
};

static struct bytes png(const void *pixels, uint32_t w, uint32_t h, int type, int depth, size_t n)
{
    spng_ctx *c = spng_ctx_new(SPNG_CTX_ENCODER);
    struct spng_ihdr header = {
        .width = w, .height = h, .bit_depth = (uint8_t)depth, .color_type = (uint8_t)type};
    struct bytes r = {0};
    int failed = 0;
    spng_set_option(c, SPNG_ENCODE_TO_BUFFER, 1);
    spng_set_ihdr(c, &header);
    failed = spng_encode_image(c, pixels, n, SPNG_FMT_PNG, SPNG_ENCODE_FINALIZE);
    r.data = spng_get_png_buffer(c, &r.bytes, &failed);
    CHECK(!failed);
    spng_ctx_free(c);
    return r;
}

/* A red, b green, c blue, d half transparent grey. */
static const uint8_t four[16] = {255, 0, 0, 255, 0, 255, 0, 255, 0, 0, 255, 255, 90, 90, 90, 128};

static const uint8_t *texel(const struct psc_scene *s, uint32_t image, uint32_t x, uint32_t y)
{
    const struct psc_image *i = &s->images[image];
    return s->texels + i->first_byte + 4 * (y * i->width + x);
}

static void factors(void)
{
    struct imported r = import_json(HEAD TRIANGLES(TRIANGLE("0") "," TRIANGLE("1") "," TRIANGLE(
        "2") ","
             "{\"attributes\":{\"POSITION\":0}}") ",\"materials\":["
                                                  "{\"pbrMetallicRoughness\":{\"baseColorFactor\":["
                                                  "0.1,"
                                                  "0.2,0.3,0.4],\"roughnessFactor\":0.6},"
                                                  "\"emissiveFactor\":[1,0.5,0],\"alphaMode\":"
                                                  "\"MASK\","
                                                  "\"alphaCutoff\":0.25,"
                                                  "\"doubleSided\":true,\"extensions\":{\"KHR_"
                                                  "materials_"
                                                  "emissive_strength\":{"
                                                  "\"emissiveStrength\":8}}},"
                                                  "{\"alphaMode\":\"BLEND\",\"extensions\":{\"KHR_"
                                                  "materials_unlit\":{}}},"
                                                  "{\"extensions\":{\"KHR_materials_"
                                                  "pbrSpecularGlossiness\":{"
                                                  "\"diffuseFactor\":[0.8,0.7,0.6,0.5],"
                                                  "\"specularFactor\":[0.1,0.2,0.3],"
                                                  "\"glossinessFactor\":0.9}}}]}");
    CHECK(r.ok && r.scene.primitive_count == 4 && r.scene.material_count == 4);
    if (!r.ok)
        return;
    const struct psc_material *m = &r.scene.materials[r.scene.primitives[0].material];
    CHECK_NEAR(m->base_color[2], 0.3, 1e-6);
    CHECK_NEAR(m->base_color[3], 0.4, 1e-6);
    CHECK_NEAR(m->metallic, 1, 0); /* the specification's default */
    CHECK_NEAR(m->roughness, 0.6, 1e-6);
    CHECK_NEAR(m->emissive[0], 8, 1e-6);
    CHECK_NEAR(m->emissive[1], 4, 1e-6);
    CHECK(m->alpha_mode == PSC_MASK && m->flags == PSC_DOUBLE_SIDED && m->base.texture == -1);
    CHECK_NEAR(m->alpha_cutoff, 0.25, 0);
    m = &r.scene.materials[r.scene.primitives[1].material];
    CHECK(m->alpha_mode == PSC_BLEND && m->flags == PSC_UNLIT);
    m = &r.scene.materials[r.scene.primitives[2].material];
    CHECK(m->alpha_mode == PSC_OPAQUE && m->flags == PSC_SPECULAR_GLOSSINESS);
    CHECK_NEAR(m->base_color[1], 0.7, 1e-6);
    CHECK_NEAR(m->specular[1], 0.2, 1e-6);
    CHECK_NEAR(m->glossiness, 0.9, 1e-6);
    m = &r.scene.materials[r.scene.primitives[3].material];
    CHECK(m->metallic == 0 && m->roughness == 1 && m->base_color[0] == 1);
    imported_free(&r);
}

static void five_slots(void)
{
    struct bytes a = png(four, 2, 2, SPNG_COLOR_TYPE_TRUECOLOR_ALPHA, 8, 16);
    char *json = text(
        HEAD TRIANGLES(TRIANGLE(
            "0")) ",\"materials\":[{"
                  "\"pbrMetallicRoughness\":{\"baseColorTexture\":{\"index\":0,\"extensions\":{"
                  "\"KHR_texture_transform\":{\"offset\":[0.5,0.25],\"rotation\":1."
                  "5707963267948966,"
                  "\"scale\":[2,3],\"texCoord\":1}}},"
                  "\"metallicRoughnessTexture\":{\"index\":1}},"
                  "\"normalTexture\":{\"index\":1,\"scale\":0.5},"
                  "\"occlusionTexture\":{\"index\":1,\"strength\":0.7,\"texCoord\":1},"
                  "\"emissiveTexture\":{\"index\":2,\"texCoord\":3}}],"
                  "\"textures\":[{\"source\":0,\"sampler\":0},{\"source\":0,\"sampler\":1},{"
                  "\"source\":1}],"
                  "\"samplers\":[{\"wrapS\":33071,\"wrapT\":33648,\"magFilter\":9728,\"minFilter\":"
                  "9984},"
                  "{\"minFilter\":9729}],"
                  "\"images\":[{\"uri\":\"data:image/png;base64,%s\"},{\"uri\":\"data:image/"
                  "jpeg;base64,%s\"}]}",
        base64(a.data, a.bytes), base64(a.data, a.bytes));
    struct imported r = import_json(json);
    free(json);
    free(a.data);
    CHECK(r.ok && r.scene.image_count == 3 && r.scene.texture_count == 3);
    if (!r.ok)
        return;
    const struct psc_material *m = &r.scene.materials[r.scene.primitives[0].material];
    /* A quarter turn, counter-clockwise with v down: u' = 3 v + 0.5, v' = -2 u + 0.25. */
    const float expected[6] = {0, 3, 0.5f, -2, 0, 0.25f};
    for (int i = 0; i < 6; i++)
        CHECK_NEAR(m->base.transform[i], expected[i], 1e-6);
    CHECK(m->base.uv_set == m->occlusion.uv_set && m->base.uv_set != m->surface.uv_set);
    CHECK(m->surface.texture == m->normal.texture && m->normal.texture == m->occlusion.texture);
    CHECK_NEAR(m->normal_scale, 0.5, 0);
    CHECK_NEAR(m->occlusion_strength, 0.7, 1e-6);
    CHECK(m->emission.uv_set == 0 && has_warning(&r.scene, "set 3 becomes 0"));
    CHECK(has_warning(&r.scene, "Image 1 is said to be image/jpeg, but is image/png"));
    const struct psc_texture *t = &r.scene.textures[m->base.texture];
    CHECK(t->wrap_s == PSC_CLAMP && t->wrap_t == PSC_MIRROR && t->nearest == 7);
    CHECK(r.scene.images[t->image].srgb == 1);
    t = &r.scene.textures[m->surface.texture];
    CHECK(t->wrap_s == PSC_REPEAT && t->wrap_t == PSC_REPEAT && t->nearest == 8);
    CHECK(r.scene.images[t->image].srgb == 0); /* image 0 again, as linear data */
    CHECK(!memcmp(texel(&r.scene, t->image, 0, 0), four, 16));
    CHECK(r.scene.images[r.scene.textures[m->emission.texture].image].srgb == 1);
    imported_free(&r);
}

/* One image through a base colour texture; returns its four texels. */
static struct imported one_image(struct bytes file, const char *mime, const char *extra)
{
    char *json = text(HEAD TRIANGLES(TRIANGLE(
                          "0")) ",\"materials\":[{"
                                "\"pbrMetallicRoughness\":{\"baseColorTexture\":{\"index\":0}}}],"
                                "\"textures\":[{%s}],\"images\":[{\"uri\":\"data:%s;base64,%s\"}]}",
        extra, mime, base64(file.data, file.bytes));
    struct imported r = import_json(json);
    free(json);
    return r;
}

static void formats(void)
{
    struct bytes file = png((uint8_t[]){0, 255, 51, 204}, 2, 2, SPNG_COLOR_TYPE_GRAYSCALE, 8, 4);
    struct imported r = one_image(file, "image/png", "\"source\":0");
    CHECK(r.ok && texel(&r.scene, 0, 0, 1)[0] == 51 && texel(&r.scene, 0, 0, 1)[2] == 51 &&
          texel(&r.scene, 0, 1, 1)[3] == 255);
    imported_free(&r);
    free(file.data);

    const uint16_t deep[4] = {0, 0xffff, 0x8080, 0x1234};
    file = png(deep, 2, 2, SPNG_COLOR_TYPE_GRAYSCALE, 16, 8);
    r = one_image(file, "image/png", "\"source\":0");
    CHECK(r.ok && texel(&r.scene, 0, 0, 1)[1] == 0x80);
    imported_free(&r);
    free(file.data);

    uint8_t flat[16 * 16 * 4];
    for (int i = 0; i < 256; i++)
        memcpy(flat + 4 * i, (uint8_t[]){200, 100, 50, 255}, 4);
    tjhandle jpeg = tjInitCompress();
    unsigned char *packed = NULL;
    unsigned long packed_bytes = 0;
    tjCompress2(jpeg, flat, 16, 0, 16, TJPF_RGBA, &packed, &packed_bytes, TJSAMP_444, 95, 0);
    tjDestroy(jpeg);
    r = one_image((struct bytes){packed, packed_bytes}, "image/jpeg", "\"source\":0");
    CHECK(r.ok && abs(texel(&r.scene, 0, 5, 5)[0] - 200) <= 2 &&
          abs(texel(&r.scene, 0, 5, 5)[2] - 50) <= 2 && texel(&r.scene, 0, 5, 5)[3] == 255);
    imported_free(&r);
    r = one_image((struct bytes){packed, packed_bytes - 8}, "image/jpeg", "\"source\":0");
    CHECK(r.ok && has_warning(&r.scene, "damaged"));
    imported_free(&r);
    tjFree(packed);

    uint8_t *webp = NULL;
    size_t webp_bytes = WebPEncodeLosslessRGBA(four, 2, 2, 8, &webp);
    r = one_image((struct bytes){webp, webp_bytes}, "image/webp",
        "\"extensions\":{\"EXT_texture_webp\":{\"source\":0}}");
    CHECK(r.ok && !memcmp(texel(&r.scene, 0, 0, 0), four, 8) && texel(&r.scene, 0, 1, 1)[3] == 128);
    imported_free(&r);
    r = one_image((struct bytes){webp, webp_bytes / 2}, "image/webp", "\"source\":0");
    CHECK(r.ok && has_warning(&r.scene, "Image 0 is drawn plain. The image is damaged"));
    CHECK(r.ok && !memcmp(texel(&r.scene, 0, 0, 0), (uint8_t[]){255, 255, 255, 255}, 4));
    imported_free(&r);
    WebPFree(webp);

    r = one_image((struct bytes){(uint8_t *)"GIF89a..........", 16}, "image/gif", "\"source\":0");
    CHECK(r.ok && has_warning(&r.scene, "The image is GIF; PNG"));
    imported_free(&r);
    r = one_image((struct bytes){(uint8_t *)"x", 1}, "image/ktx2",
        "\"extensions\":{\"KHR_texture_basisu\":{\"source\":0}}");
    CHECK(r.ok && has_warning(&r.scene, "drawn plain"));
    CHECK(r.ok && r.scene.image_count == 1 && r.scene.images[0].width == 1);
    imported_free(&r);
}

/* The first source that can be read counts, whichever extension names it: here a PNG. */
static void sources(void)
{
    const char *const names[] = {
        "EXT_texture_avif", "EXT_texture_webp", "KHR_texture_basisu", "MSFT_texture_dds"};
    struct bytes file = png(four, 2, 2, SPNG_COLOR_TYPE_TRUECOLOR_ALPHA, 8, 16);
    for (size_t i = 0; i < 2 * sizeof names / sizeof *names; i++) {
        bool fallback = i % 2; /* else the extension's own */
        char *json =
            text(HEAD TRIANGLES(TRIANGLE("0")) ",\"materials\":[{\"pbrMetallicRoughness\":{"
                                               "\"baseColorTexture\":{\"index\":0}}}],"
                                               "\"textures\":[{\"source\":%d,\"extensions\":{"
                                               "\"%s\":{\"source\":%d}}}],\"images\":["
                                               "{\"uri\":\"data:image/ktx2;base64,q0tUWCAyMLs=\"},"
                                               "{\"uri\":\"data:;base64,%s\"}]}",
                fallback, names[i / 2], !fallback, base64(file.data, file.bytes));
        struct imported r = import_json(json);
        CHECK(r.ok && !has_warning(&r.scene, "drawn plain"));
        CHECK(r.ok && !memcmp(texel(&r.scene, 0, 0, 0), four, 8));
        imported_free(&r);
        free(json);
    }
    free(file.data);
}

/* One image that cannot be decoded, in every role: what it becomes there changes nothing. */
static void plain(void)
{
    struct imported r = import_json(HEAD TRIANGLES(
        TRIANGLE("0") "," TRIANGLE("1")) ",\"materials\":[{\"pbrMetallicRoughness\":{"
                                         "\"baseColorTexture\":{\"index\":0},"
                                         "\"metallicRoughnessTexture\":{\"index\":0}},"
                                         "\"normalTexture\":{\"index\":0},"
                                         "\"occlusionTexture\":{\"index\":0},"
                                         "\"emissiveTexture\":{\"index\":0}},"
                                         "{\"extensions\":{\"KHR_materials_"
                                         "pbrSpecularGlossiness\":{"
                                         "\"specularGlossinessTexture\":{\"index\":0}}}}],"
                                         "\"textures\":[{\"source\":0}],"
                                         "\"images\":[{\"uri\":\"data:image/ktx2;base64,"
                                         "q0tUWCAyMLsNChoK\"}]}");
    CHECK(r.ok && has_warning(&r.scene, "KTX2"));
    if (!r.ok)
        return;
    const struct psc_material *m = &r.scene.materials[r.scene.primitives[0].material];
    const struct psc_material *gloss = &r.scene.materials[r.scene.primitives[1].material];
    const struct {
        int32_t texture;
        uint8_t texel[4];
    } expected[] = {{m->base.texture, {255, 255, 255, 255}},
        {m->surface.texture, {255, 255, 0, 255}}, /* rough, no metal */
        {m->normal.texture, {128, 128, 255, 255}}, {m->occlusion.texture, {255, 255, 255, 255}},
        {m->emission.texture, {0, 0, 0, 255}},
        {gloss->surface.texture, {56, 56, 56, 128}}}; /* sRGB of 0.04 */
    for (size_t i = 0; i < sizeof expected / sizeof *expected; i++) {
        CHECK(expected[i].texture >= 0);
        uint32_t image = r.scene.textures[expected[i].texture].image;
        CHECK(!memcmp(texel(&r.scene, image, 0, 0), expected[i].texel, 4));
    }
    imported_free(&r);
}

/* KHR_materials_ior and KHR_materials_specular: F0 = ((n - 1) / (n + 1))^2, times their factors. */
static void reflectance(void)
{
    const struct {
        const char *extensions;
        double f0;
    } cases[] = {{"", 0.04}, {"\"KHR_materials_ior\":{}", 0.04},
        {"\"KHR_materials_ior\":{\"ior\":1.33}", 0.33 * 0.33 / (2.33 * 2.33)},
        {"\"KHR_materials_ior\":{\"ior\":2.42}", 1.42 * 1.42 / (3.42 * 3.42)},
        {"\"KHR_materials_ior\":{\"ior\":1}", 0}, {"\"KHR_materials_ior\":{\"ior\":0}", 1},
        {"\"KHR_materials_ior\":{\"ior\":-1}", 1},
        {"\"KHR_materials_specular\":{\"specularFactor\":0.25}", 0.01},
        {"\"KHR_materials_specular\":{\"specularFactor\":-3}", 0},
        {"\"KHR_materials_specular\":{\"specularColorFactor\":[50,2,2]}", 1},
        {"\"KHR_materials_ior\":{\"ior\":2},\"KHR_materials_specular\":{\"specularFactor\":0.5,"
         "\"specularColorFactor\":[0.5,1,1]}",
            1.0 / 36}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char *json =
            text(HEAD TRIANGLES(TRIANGLE("0")) ",\"extensionsRequired\":[\"KHR_materials_ior\","
                                               "\"KHR_materials_specular\"],"
                                               "\"materials\":[{\"extensions\":{%s}}]}",
                cases[i].extensions);
        struct imported r = import_json(json);
        CHECK(r.ok);
        if (r.ok)
            CHECK_NEAR(0.04 * r.scene.materials[r.scene.primitives[0].material].specular[0],
                cases[i].f0, 1e-6);
        imported_free(&r);
        free(json);
    }
}

static void image_mode(void)
{
    struct bytes file = png(four, 2, 2, SPNG_COLOR_TYPE_TRUECOLOR_ALPHA, 8, 16);
    const uint8_t source[PEN_ID_BYTES] = {7};
    struct pen_error error = {0};
    struct psc_scene scene;
    void *blob;
    size_t bytes;
    CHECK(pen_import(file.data, file.bytes, PEN_IMPORT_IMAGE, source, &blob, &bytes, &error));
    CHECK(!error.code && psc_open_memory(blob, bytes, &scene, &error));
    CHECK(scene.image_count == 1 && scene.images[0].srgb == 1 && scene.images[0].levels == 2);
    CHECK(scene.header->source[0] == 7 && !scene.instance_count);
    free(blob);
    for (size_t n = 0; n < file.bytes; n++) { /* every truncation: refused, nothing leaks */
        memset(&error, 0, sizeof error);
        bool done = pen_import(file.data, n, PEN_IMPORT_IMAGE, source, &blob, &bytes, &error);
        if (done) /* all pixels were there: only the end marker can be missing */
            free(blob);
        CHECK(done ? n >= file.bytes - 16 : pen_code_blame(error.code) == PEN_BLAME_CALLER);
    }
    free(file.data);
}

/* Five of 8000 x 8000 are 305 million pixels; each is allowed by itself, and none has any data. */
static void too_many_pixels(void)
{
    struct bytes file = png(four, 2, 2, SPNG_COLOR_TYPE_TRUECOLOR_ALPHA, 8, 16);
    const uint8_t header[17] = {'I', 'H', 'D', 'R', 0, 0, 31, 64, 0, 0, 31, 64, 8, 6};
    memcpy(file.data + 12, header, sizeof header);
    uint32_t crc = 0xffffffff; /* section D.2 of the PNG specification, bit by bit */
    for (int i = 0; i < 17 * 8; i++)
        crc = (crc >> 1) ^ (((crc ^ (header[i / 8] >> i % 8)) & 1) ? 0xedb88320 : 0);
    for (int i = 0; i < 4; i++)
        file.data[29 + i] = (uint8_t)(~crc >> (24 - 8 * i));
    const char *uri = base64(file.data, file.bytes);
    char *json = text(
        HEAD TRIANGLES(TRIANGLE(
            "0")) ",\"materials\":[{"
                  "\"pbrMetallicRoughness\":{\"baseColorTexture\":{\"index\":0},"
                  "\"metallicRoughnessTexture\":{\"index\":1}},\"normalTexture\":{\"index\":2},"
                  "\"occlusionTexture\":{\"index\":3},\"emissiveTexture\":{\"index\":4}}],"
                  "\"textures\":[{\"source\":0},{\"source\":1},{\"source\":2},{\"source\":3},{"
                  "\"source\":4}],"
                  "\"images\":[{\"uri\":\"data:;base64,%s\"},{\"uri\":\"data:;base64,%s\"},"
                  "{\"uri\":\"data:;base64,%s\"},{\"uri\":\"data:;base64,%s\"},"
                  "{\"uri\":\"data:;base64,%s\"}]}",
        uri, uri, uri, uri, uri);
    struct imported r = import_json(json);
    CHECK(r.error.code == PEN_TOO_BIG && strstr(r.error.message, "together"));
    imported_free(&r);
    free(json);
    free(file.data);
}

/* Images beyond the budget are halved: 7 of 4096 x 4096 are 112 million pixels. */
static void reduction(void)
{
    uint8_t *zeros = calloc(4096, 512);
    struct bytes file = png(zeros, 4096, 4096, SPNG_COLOR_TYPE_GRAYSCALE, 1, 4096 * 512);
    char images[7 * 9000] = "", textures[400] = "", materials[1200] = "", primitives[600] = "";
    for (int i = 0; i < 7; i++) {
        const char *comma = i ? "," : "";
        char *at = images + strlen(images);
        snprintf(at, sizeof images - (size_t)(at - images),
            "%s{\"uri\":\"data:image/png;base64,%s\"}", comma, base64(file.data, file.bytes));
        at = textures + strlen(textures);
        snprintf(at, sizeof textures - (size_t)(at - textures), "%s{\"source\":%d}", comma, i);
        at = materials + strlen(materials);
        snprintf(at, sizeof materials - (size_t)(at - materials),
            "%s{\"pbrMetallicRoughness\":{\"baseColorTexture\":{\"index\":%d}}}", comma, i);
        at = primitives + strlen(primitives);
        snprintf(at, sizeof primitives - (size_t)(at - primitives),
            "%s{\"attributes\":{\"POSITION\":0},\"material\":%d}", comma, i);
    }
    char *json = text(HEAD TRIANGLES("%s") ",\"materials\":[%s],\"textures\":[%s],\"images\":[%s]}",
        primitives, materials, textures, images);
    struct imported r = import_json(json);
    free(json);
    free(file.data);
    free(zeros);
    CHECK(r.ok && has_warning(&r.scene, "from 4096 x 4096 to 2048 x 2048"));
    uint64_t pixels = 0;
    for (uint32_t i = 0; r.ok && i < r.scene.image_count; i++)
        pixels += (uint64_t)r.scene.images[i].width * r.scene.images[i].height;
    CHECK(pixels > 80u << 20 && pixels <= 96u << 20);
    imported_free(&r);
}

int main(void)
{
    factors();
    five_slots();
    formats();
    sources();
    plain();
    reflectance();
    image_mode();
    too_many_pixels();
    reduction();
    CHECK_DONE();
}
