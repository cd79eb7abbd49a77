/* The real binary on real scenes, and on uploads that break its limits. */
#include "tests/unit/check.h"
#include "tests/unit/import_run.h"
#include "renderer/blob/pscene.h"
#include <sys/wait.h>
#include <unistd.h>

/* What the files hold, counted from their JSON: index counts of triangle primitives over 3. (The
 * hotel room has a further primitive of 20,665 lines.) */
static const struct {
    const char *name;
    uint64_t triangles;
    uint32_t primitives, images;
    float min[3], max[3];
    uint32_t lines; /* primitives of them, drawn as bars of eight triangles */
} expected[] = {
    {"stanford-bunny-on-plane.glb", 69453, 2, 0, {-5, 0, -5}, {5, 1, 5}},
    {"japanese-bridge-garden.glb", 21883, 13, 0, {-5.5272f, 0.3775f, -5.2646f},
        {5.8331f, 7.3903f, 6.1010f}},
    {"hotel-room.glb", 99029, 11, 6, {6791.5f, -66.1975f, -11129.2f},
        {13274.5f, 2130.7407f, -1134.3197f}, .lines = 1},
    {"shader-ball.glb", 63856, 4, 2, {-4.4399f, 0, -4.4399f}, {4.4607f, 8.2013f, 4.4607f}},
};

static bool shared_scenes(void)
{
    const char *shared = getenv("PENUMBRA_SHARED");
    char path[1024];
    for (size_t i = 0; i < sizeof expected / sizeof *expected; i++) {
        snprintf(path, sizeof path, "%s/scenes/%s", shared ? shared : SHARED, expected[i].name);
        if (access(path, R_OK))
            return false;
        struct run run = run_importer(path, NULL);
        struct pen_error error = {0};
        struct psc_scene scene = {0};
        CHECK(run.status == 0 && run.reported && run.error.code == PEN_OK);
        CHECK(run.blob && psc_open_memory(run.blob, run.blob_bytes, &scene, &error));
        printf("%s: %.3f s, %ld MB, %zu bytes\n", expected[i].name, run.seconds, run.memory_mb,
            run.blob_bytes);
        if (scene.header) {
            uint32_t lines = expected[i].lines;
            uint64_t bars = scene.header->triangles - expected[i].triangles;
            CHECK(lines ? bars > 0 && bars % 8 == 0 : bars == 0);
            CHECK(scene.primitive_count == expected[i].primitives + lines);
            CHECK(scene.image_count == expected[i].images);
            CHECK(scene.header->source[1] == 0x11 && scene.header->source[31] == 0xff);
            for (int k = 0; k < 3; k++) {
                float size = expected[i].max[k] - expected[i].min[k];
                /* Its lines reach a little beyond its faces. */
                float most = lines ? 0.01f : 1e-4f;
                CHECK_NEAR(scene.header->extent_min[k], expected[i].min[k], most * size);
                CHECK_NEAR(scene.header->extent_max[k], expected[i].max[k], most * size);
            }
        }
        struct run again = run_importer(path, NULL); /* the same bytes give the same blob */
        CHECK(again.blob_bytes == run.blob_bytes && !memcmp(again.blob, run.blob, run.blob_bytes));
        free(run.blob);
        free(again.blob);
    }
    return true;
}

static void write_file(const char *path, const char *text)
{
    FILE *file = fopen(path, "w");
    fputs(text, file);
    fclose(file);
}

/* 15 million vertices of zeros, unindexed: allowed, but not within 64 MB. */
static void out_of_memory(const char *folder)
{
    char path[256];
    snprintf(path, sizeof path, "%s/large.gltf", folder);
    write_file(path, "{\"asset\":{\"version\":\"2.0\"},\"nodes\":[{\"mesh\":0}],\"meshes\":[{"
                     "\"primitives\":[{\"attributes\":{\"POSITION\":0}}]}],\"accessors\":[{"
                     "\"componentType\":5126,\"count\":15000000,\"type\":\"VEC3\"}]}");
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
    struct run run = run_importer(path, "--memory-mb=64");
    CHECK(run.status == 0 && run.reported && run.error.code == PEN_TOO_BIG);
    CHECK(run.memory_mb < 128 && !run.blob);
    CHECK(strstr(run.error.message, "64 MB"));
    free(run.blob);
#endif
    struct run slow = run_importer(path, "--cpu-seconds=1");
    CHECK(slow.status == 0 && slow.reported);
    CHECK(slow.error.code == PEN_OK || strstr(slow.error.message, "1 CPU seconds"));
    free(slow.blob);
    unlink(path);
}

static void misuse(void)
{
    const char *wrong[][6] = {{IMPORTER, NULL}, {IMPORTER, "--mode", "scene", NULL},
        {IMPORTER, "--mode", "nothing", "--source-id", "00", NULL}};
    for (size_t i = 0; i < 3; i++) {
        pid_t pid = fork();
        if (pid == 0) {
            if (!freopen("/dev/null", "w", stderr))
                _exit(1);
            execv(IMPORTER, (char *const *)wrong[i]);
            _exit(127);
        }
        int status;
        waitpid(pid, &status, 0);
        CHECK(WIFEXITED(status) && WEXITSTATUS(status) == 2);
    }
}

int main(void)
{
    char folder[] = "/tmp/penumbra-import-XXXXXX";
    CHECK(mkdtemp(folder));
    out_of_memory(folder);
    misuse();
    rmdir(folder);
    bool have_scenes = shared_scenes();
    if (!have_scenes && !check_failures)
        return 77;
    CHECK_DONE();
}
