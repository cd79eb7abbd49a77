#include "tests/bench/claims/plan.h"
#include "protocol/json_request.h"
#include "renderer/generate/generate.h"
#include "renderer/renderer.h"
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

#define FIELDS 8
#define SCENES 64
#define PAIRS 96

static struct plan_scene scenes[SCENES];
static uint32_t scene_count;

static void die(const char *what, const char *detail)
{
    fprintf(stderr, "claims: %s: %s\n", what, detail);
    exit(2);
}

static void copy(char *to, size_t room, const char *from)
{
    if (strlen(from) >= room)
        die("too long", from);
    memcpy(to, from, strlen(from) + 1);
}

static struct plan_scene *find_scene(const char *name)
{
    for (uint32_t i = 0; i < scene_count; i++)
        if (!strcmp(scenes[i].name, name))
            return &scenes[i];
    die("unknown scene", name);
    return NULL;
}

static void add_scene(char **field)
{
    if (scene_count == SCENES)
        die("too many scenes", field[1]);
    struct plan_scene *scene = &scenes[scene_count++];
    copy(scene->name, sizeof scene->name, field[1]);
    scene->fd = -1;
    scene->id[0] = 1, scene->id[1] = (uint8_t)scene_count;
    if (!strcmp(field[2], "file")) {
        copy(scene->path, sizeof scene->path, field[3]);
        return;
    }
    int kind = pen_choice_index(pen_generated_names, field[3]);
    if (kind < 0)
        die("unknown kind of scene", field[3]);
    scene->kind = (uint32_t)kind;
    scene->triangles = (uint32_t)strtoul(field[4], NULL, 10);
}

int plan_scene_open(struct plan_scene *scene)
{
    struct pen_error error = {0};
    void *data;
    size_t bytes;
    if (scene->fd >= 0)
        return scene->fd;
    if (scene->path[0]) {
        if ((scene->fd = open(scene->path, O_RDONLY | O_CLOEXEC)) < 0)
            die("cannot open", scene->path);
        return scene->fd;
    }
    struct pen_generated_options options = {.kind = scene->kind, .triangles = scene->triangles};
    if (!pen_generate_blob(&options, &data, &bytes, &error))
        die(scene->name, error.message);
    scene->fd = memfd_create("scene", MFD_CLOEXEC);
    for (size_t done = 0; done < bytes;) {
        ssize_t n = write(scene->fd, (char *)data + done, bytes - done);
        if (n <= 0)
            die(scene->name, "write");
        done += (size_t)n;
    }
    free(data);
    return scene->fd;
}

static void split_pairs(char *text, struct pen_query_pair *pairs, uint32_t *count)
{
    char *state = NULL;
    for (char *at = strtok_r(text, "&", &state); at; at = strtok_r(NULL, "&", &state)) {
        char *equals = strchr(at, '=');
        if (!equals || *count == PAIRS)
            die("bad settings", at);
        *equals = 0;
        /* What a variant says wins over what its group says. */
        uint32_t i = 0;
        while (i < *count && strcmp(pairs[i].key, at))
            i++;
        pairs[i] = (struct pen_query_pair){at, equals + 1};
        *count += i == *count;
    }
}

static bool is_known(const struct pen_query_pair *pairs, uint32_t count)
{
    for (uint32_t i = 0; i < count; i++)
        if (!strcmp(pairs[i].key, "technique"))
            return pen_catalogue_find(pen_renderer_catalogue(), pairs[i].value) != NULL;
    return false;
}

static void read_variant(const struct plan_group *group, struct plan_variant *variant)
{
    struct pen_query_pair pairs[PAIRS];
    uint32_t count = 0;
    char *shared = strdup(group->settings), *own = strdup(variant->settings);
    split_pairs(shared, pairs, &count);
    split_pairs(own, pairs, &count);
    variant->error = (struct pen_error){0};
    if (!is_known(pairs, count))
        variant->status = VARIANT_MISSING;
    else
        variant->status = pen_request_from_query(pairs, count, pen_renderer_catalogue(),
                              &variant->request, &variant->error)
                              ? VARIANT_OK
                              : VARIANT_FAILED;
    memcpy(variant->request.scene, group->scene->id, PEN_ID_BYTES);
    free(shared);
    free(own);
}

static uint32_t find_variant(const struct plan_group *group, const char *name)
{
    uint32_t i = 0;
    while (i < group->variant_count && strcmp(group->variants[i].name, name))
        i++;
    if (i == group->variant_count)
        die("unknown variant", name);
    return i;
}

static uint32_t split_fields(char *line, char **field)
{
    uint32_t count = 0;
    line[strcspn(line, "\n")] = 0;
    for (char *at; count < FIELDS && (at = strsep(&line, "\t"));)
        field[count++] = at;
    return count;
}

static void add_line(struct plan_group *group, char **field, uint32_t count)
{
    if (!strcmp(field[0], "scene") && count >= 4) {
        if (!strcmp(field[2], "generated") && count < 5)
            die("scene", field[1]);
        add_scene(field);
    } else if (!strcmp(field[0], "group") && count == 7) {
        memset(group, 0, sizeof *group);
        copy(group->name, sizeof group->name, field[1]);
        group->scene = find_scene(field[2]);
        group->repetitions = (uint32_t)strtoul(field[3], NULL, 10);
        group->seconds = strtod(field[4], NULL);
        copy(group->flags, sizeof group->flags, field[5]);
        copy(group->settings, sizeof group->settings, field[6]);
    } else if (!strcmp(field[0], "variant") && count == 3 && group->scene) {
        if (group->variant_count == PLAN_VARIANTS)
            die("too many variants", field[1]);
        struct plan_variant *variant = &group->variants[group->variant_count++];
        copy(variant->name, sizeof variant->name, field[1]);
        copy(variant->settings, sizeof variant->settings, field[2]);
        read_variant(group, variant);
    } else if (!strcmp(field[0], "compare") && count == 3 && group->pair_count < PLAN_PAIRS) {
        uint32_t *pair = group->pairs[group->pair_count++];
        pair[0] = find_variant(group, field[1]), pair[1] = find_variant(group, field[2]);
    } else {
        die("bad line", field[0]);
    }
}

bool plan_next(FILE *file, struct plan_group *group)
{
    char *line = NULL, *field[FIELDS];
    size_t room = 0;
    bool run = false;
    while (!run && getline(&line, &room, file) > 0) {
        uint32_t count = split_fields(line, field);
        if (!strcmp(field[0], "run"))
            run = true;
        else if (field[0][0])
            add_line(group, field, count);
    }
    free(line);
    return run;
}
