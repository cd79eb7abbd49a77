#include "renderer/import/files/foreign.h"
#include <stdbool.h>
#include <string.h>
#include <strings.h>

#define EXPORT(what)                                                                               \
    "It is " what ": export it as glTF (.glb), for example from Blender or with assimp."
#define UNPACK(what) "It is " what ": upload what is in it, or pack that as .zip."

static const struct {
    const char *suffix, *magic; /* magic: "" none that is sure */
    size_t at, bytes;
    const char *text;
} kinds[] = {
    {".fbx", "Kaydara FBX", 0, 11, EXPORT("FBX")},
    {".fbx", "; FBX", 0, 5, EXPORT("FBX")},
    {".obj", "", 0, 0, EXPORT("Wavefront OBJ")},
    {".stl", "solid ", 0, 6, EXPORT("STL")},
    {".ply", "ply\n", 0, 4, EXPORT("PLY")},
    {".ply", "ply\r\n", 0, 5, EXPORT("PLY")},
    {".blend", "BLENDER", 0, 7, EXPORT("a Blender file")},
    {".usdz", "", 0, 0, EXPORT("USD")},
    {".usdc", "PXR-USDC", 0, 8, EXPORT("USD")},
    {".usda", "#usda", 0, 5, EXPORT("USD")},
    {".usd", "", 0, 0, EXPORT("USD")},
    {".dae", "", 0, 0, EXPORT("COLLADA")},
    {".3ds", "", 0, 0, EXPORT("3DS")},
    {".3mf", "", 0, 0, EXPORT("3MF")},
    {".model", "", 0, 0, EXPORT("3MF")},
    {".step", "ISO-10303-21", 0, 12, EXPORT("STEP")},
    {".stp", "", 0, 0, EXPORT("STEP")},
    {".wrl", "#VRML", 0, 5, EXPORT("VRML")},
    {".b3dm", "b3dm", 0, 4,
        "It is a 3D tile: upload the glTF in it (3d-tiles-tools b3dmToGlb takes it out)."},
    {".zip", "PK\3\4", 0, 4, UNPACK("a zip file in the upload")},
    {".gz", "\x1f\x8b", 0, 2, UNPACK("packed with gzip")},
    {".7z", "7z\xbc\xaf\x27\x1c", 0, 6, UNPACK("a 7-Zip file")},
    {".rar", "Rar!", 0, 4, UNPACK("a RAR file")},
    {".tar", "ustar", 257, 5, UNPACK("a tar file")},
    {"", "version https://git-lfs", 0, 23,
        "It is a pointer of Git LFS, not the file: git lfs pull fetches it."},
    {".html", "<!doctype html", 0, 14, "It is a web page: the link does not lead to the file."},
    {".html", "<html", 0, 5, "It is a web page: the link does not lead to the file."},
    {".png", "\x89PNG", 0, 4, "It is an image; images are uploaded to /v1/images."},
    {".jpg", "\xff\xd8\xff", 0, 3, "It is an image; images are uploaded to /v1/images."},
    {"", "\xff\xfe", 0, 2, "It is text in UTF-16, but JSON is in UTF-8."},
};

static bool in_first_kilobyte(const uint8_t *data, size_t bytes, const char *word)
{
    return memmem(data, bytes < 1024 ? bytes : 1024, word, strlen(word)) != NULL;
}

static bool is_text(const uint8_t *data, size_t bytes)
{
    for (size_t i = 0; i < bytes && i < 4096; i++)
        if (data[i] < 0x20 && data[i] != '\t' && data[i] != '\r' && data[i] != '\n')
            return false;
    return true;
}

const char *imp_foreign_bytes(const uint8_t *data, size_t bytes)
{
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++)
        if (kinds[i].bytes && bytes >= kinds[i].at + kinds[i].bytes &&
            !strncasecmp((const char *)data + kinds[i].at, kinds[i].magic, kinds[i].bytes))
            return kinds[i].text;
    uint32_t triangles = 0;
    if (bytes >= 84)
        memcpy(&triangles, data + 80, 4);
    if (bytes >= 84 && bytes == 84 + 50 * (uint64_t)triangles)
        return imp_foreign_name("x.stl");
    if (in_first_kilobyte(data, bytes, "<COLLADA"))
        return imp_foreign_name("x.dae");
    if (is_text(data, bytes) &&
        (in_first_kilobyte(data, bytes, "\nv ") || in_first_kilobyte(data, bytes, "mtllib ")))
        return imp_foreign_name("x.obj");
    return NULL;
}

const char *imp_foreign_name(const char *name)
{
    const char *dot = strrchr(name, '.');
    for (size_t i = 0; dot && i < sizeof kinds / sizeof *kinds; i++)
        if (!strcasecmp(dot, kinds[i].suffix))
            return kinds[i].text;
    return NULL;
}
