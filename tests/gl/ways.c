/* What is drawn one way in software and another on a GPU comes to the same: edges, rays, sums of maps,
 * their mips, pieces of work. On a GPU both are its own ways, and nothing is shown. */
#include "tests/gl/fixture.h"
#include "tests/unit/check.h"
#include <stdio.h>
#include <string.h>

/* Of 255, root mean square. Edges are rounded once on either way but at different places; rays agree
 * but where rounding decides one that grazes an edge. */
#define NEAR 1.0
/* `denoised` filters only where Embree traces: elsewhere its few rays are what is seen. */
#define NOISE 3.0

#define MOST 64

struct picture {
    char technique[32];
    uint32_t scene; /* FOLIAGE has edges of alpha */
    struct pen_frame frame;
    struct pen_result result;
};
enum { DEMO, FOLIAGE };

static uint32_t choose(struct picture pictures[MOST])
{
    const struct pen_catalogue *catalogue = pen_renderer_catalogue();
    uint32_t count = 0;
    for (uint32_t i = 0; i < catalogue->count; i++)
        for (uint32_t scene = DEMO; scene <= FOLIAGE; scene++) {
            const char *name = catalogue->items[i]->name;
            if (scene == FOLIAGE && strcmp(name, "pcss") && strcmp(name, "raytraced"))
                continue;
            CHECK(count < MOST);
            pictures[count].scene = scene;
            snprintf(pictures[count++].technique, sizeof pictures->technique, "%s", name);
        }
    return count;
}

/* The second time: with the light and the exposure of the first. */
static bool render(struct picture *pictures, uint32_t count, bool as_gpu)
{
    struct pen_error error = {0};
    struct pen_renderer_config config = {
        .device = {.choice = PEN_DEVICE_AUTO, .debug = true}, .as_gpu = as_gpu};
    struct pen_renderer *r = pen_renderer_create(&config, &error);
    uint8_t ids[2][PEN_ID_BYTES];
    if (!r) {
        fprintf(stderr, "skipped: %s\n", error.message);
        return false;
    }
    fixture_scene(r, PEN_GENERATED_DEMO, 0, 1, ids[DEMO]);
    fixture_scene(r, PEN_GENERATED_FOLIAGE, 3000, 1, ids[FOLIAGE]);
    for (uint32_t i = 0; i < count; i++) {
        struct picture *p = &pictures[i];
        struct pen_frame frame;
        struct pen_request request;
        fixture_request(&request, ids[p->scene], p->technique);
        request.width = 120, request.height = 90;
        if (as_gpu)
            request = p->result.completed;
        bool ok = pen_renderer_render(r, &request, &frame, &p->result, &error);
        if (!ok)
            fprintf(stderr, "%s: %s\n", p->technique, error.message);
        CHECK(ok);
        if (ok && as_gpu) {
            double distance = fixture_distance(&p->frame, &frame);
            fprintf(stderr, "%s, scene %u: %.3f\n", p->technique, p->scene, distance);
            CHECK(distance <= (strcmp(p->technique, "denoised") ? NEAR : NOISE));
            pen_frame_finish(&frame);
        } else if (ok) {
            p->frame = frame;
        }
    }
    pen_renderer_destroy(r);
    return true;
}

int main(void)
{
    static struct picture pictures[MOST];
    uint32_t count = choose(pictures);
    if (!render(pictures, count, false) || !render(pictures, count, true))
        return 77;
    for (uint32_t i = 0; i < count; i++)
        pen_frame_finish(&pictures[i].frame);
    CHECK_DONE();
}
