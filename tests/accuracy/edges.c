/* Edges at the default against 64 jittered frames: the error on pixels that show more than one
 * surface, as a share of what one sample per pixel leaves.
 *
 * usage: accuracy_edges [SCENE.pscene ...] */
#include "protocol/json_request.h"
#include "tests/accuracy/quads.h"
#include "tests/unit/check.h"
#include <math.h>
#include <stdio.h>

#define WIDTH 400
#define HEIGHT 300
#define FINER 4

static void picture(const uint8_t *id, const char *settings, struct pen_frame *frame)
{
    struct pen_error error = {0};
    struct pen_query_pair pairs[32];
    struct pen_request request;
    struct pen_result result;
    uint32_t count = 0;
    char text[1024], *state = NULL;
    snprintf(text, sizeof text, "%s", settings);
    for (char *at = strtok_r(text, "&", &state); at && count < 32;
         at = strtok_r(NULL, "&", &state)) {
        char *equals = strchr(at, '=');
        *equals = 0;
        pairs[count++] = (struct pen_query_pair){at, equals + 1};
    }
    if (!pen_request_from_query(pairs, count, pen_renderer_catalogue(), &request, &error)) {
        fprintf(stderr, "%s: %s %s\n", settings, error.pointer, error.message);
        exit(1);
    }
    memcpy(request.scene, id, PEN_ID_BYTES);
    if (!pen_renderer_render(harness_renderer(), &request, frame, &result, &error)) {
        fprintf(stderr, "%s: %s %s\n", settings, error.pointer, error.message);
        exit(1);
    }
}

/* Pixels whose FINER x FINER parts do not lie on one plane: reciprocal depth is linear along it. */
static uint8_t *edge_pixels(const uint8_t *id, const char *settings)
{
    char text[1024];
    struct pen_frame depth;
    uint8_t *mask = calloc(WIDTH * HEIGHT, 1);
    snprintf(text, sizeof text,
        "%s&width=%d&height=%d&output.layer=depth&output.format=exr&output.bit_depth=32", settings,
        WIDTH * FINER, HEIGHT * FINER);
    picture(id, text, &depth);
    const float *d = depth.planes[0].data;
    const size_t row = (size_t)WIDTH * FINER;
    for (size_t y = 0; y < HEIGHT * FINER; y++)
        for (size_t x = 0; x < row; x++)
            for (int k = 0; k < 2; k++) {
                size_t at = y * row + x, step = k ? row : 1, within = (k ? y : x) % FINER;
                if (!within || within == FINER - 1)
                    continue; /* a neighbour is another pixel's */
                float a = d[4 * (at - step)], b = d[4 * at], c = d[4 * (at + step)];
                bool jump = (a > 0) != (b > 0) || (b > 0) != (c > 0);
                if (a > 0 && b > 0 && c > 0)
                    jump = fabsf(1 / a + 1 / c - 2 / b) > 0.3f * fabsf(1 / a - 1 / c) + 2e-4f / b;
                mask[y / FINER * WIDTH + x / FINER] |= jump;
            }
    pen_frame_finish(&depth);
    return mask;
}

static double rmse(const struct pen_frame *a, const struct pen_frame *b, const uint8_t *mask)
{
    const uint8_t *p = a->planes[0].data, *q = b->planes[0].data;
    double sum = 0;
    uint32_t count = 0;
    for (uint32_t i = 0; i < WIDTH * HEIGHT; i++) {
        if (mask && !mask[i])
            continue;
        for (int k = 0; k < 3; k++)
            sum += (p[4 * i + k] - q[4 * i + k]) * (p[4 * i + k] - q[4 * i + k]);
        count++;
    }
    return sqrt(sum / (3 * fmax(count, 1)));
}

/* mask: of its edge pixels. */
static void check_edges(
    const char *name, const uint8_t *id, const char *more, const uint8_t *mask, double most)
{
    char settings[512], text[1024];
    struct pen_frame truth, stairs, smooth;
    snprintf(
        settings, sizeof settings, "technique=pcss&width=%d&height=%d&%s", WIDTH, HEIGHT, more);
    snprintf(text, sizeof text, "%s&antialias=64", settings);
    picture(id, text, &truth);
    snprintf(text, sizeof text, "%s&edges=none", settings);
    picture(id, text, &stairs);
    picture(id, settings, &smooth);
    uint32_t edges = 0;
    for (uint32_t i = 0; i < WIDTH * HEIGHT; i++)
        edges += mask[i];
    double one = rmse(&stairs, &truth, mask), ours = rmse(&smooth, &truth, mask);
    printf("%-28s edge pixels %5.2f %%, rmse %6.2f of 255, smooth %6.2f: ratio %.3f; all pixels "
           "%.2f, %.2f\n",
        name, 100.0 * edges / (WIDTH * HEIGHT), one, ours, ours / one, rmse(&stairs, &truth, NULL),
        rmse(&smooth, &truth, NULL));
    fflush(stdout);
    CHECK(ours <= most * one);
    pen_frame_finish(&truth);
    pen_frame_finish(&stairs);
    pen_frame_finish(&smooth);
}

static void check_scene(const char *name, const uint8_t *id, const char *more, double most)
{
    char settings[512];
    snprintf(settings, sizeof settings, "technique=pcss&%s", more);
    uint8_t *mask = edge_pixels(id, settings);
    check_edges(name, id, more, mask, most);
    free(mask);
}

/* Panes before slats: edges of both, and of the slats through the panes. */
static void check_panes(void)
{
    static const char view[] = "camera.eye=0,0,4&camera.target=0,0,0&camera.fov_y_deg=40&sky=on";
    enum { SLATS = 5, PANES = 2 };
    struct quad quads[SLATS + PANES];
    uint8_t id[PEN_ID_BYTES], *masks[2];
    for (int i = 0; i < SLATS; i++)
        quads[i] = (struct quad){{0.55f * (float)i - 1.1f, 0, -0.2f * (float)i}, {0.13f, 0.03f, 0},
            {-0.2f, 0.9f, 0.1f}, {0.8f, 0.3f, 0.1f, 1}};
    quads[SLATS] = (struct quad){
        {-0.3f, 0.1f, 0.5f}, {0.6f, 0.17f, 0.1f}, {-0.13f, 0.5f, 0}, {0.2f, 0.5f, 0.9f, 1}};
    quads[SLATS + 1] = (struct quad){
        {0.4f, -0.2f, 0.9f}, {0.4f, -0.11f, 0}, {0.07f, 0.4f, 0.1f}, {0.9f, 0.9f, 0.3f, 1}};
    for (int i = 0; i < 2; i++) { /* with panes that are solid, and without them */
        load_quads(quads, i ? SLATS : SLATS + PANES, false, id);
        masks[i] = edge_pixels(id, view);
    }
    for (uint32_t i = 0; i < WIDTH * HEIGHT; i++)
        masks[0][i] |= masks[1][i];
    quads[SLATS].color[3] = quads[SLATS + 1].color[3] = 0.45f;
    load_quads(quads, SLATS + PANES, false, id);
    check_edges("panes", id, view, masks[0], 0.5);
    free(masks[0]);
    free(masks[1]);
}

int main(int argc, char **argv)
{
    uint8_t id[PEN_ID_BYTES];
    for (int i = 1; i < argc; i++)
        if (harness_scene_file(argv[i], id))
            check_scene(
                strrchr(argv[i], '/') ? strrchr(argv[i], '/') + 1 : argv[i], id, "sky=on", 1);
    if (argc > 1)
        CHECK_DONE();
    harness_scene(&(struct pen_generated_options){.kind = PEN_GENERATED_COLUMNS}, id);
    check_scene("columns", id, "sky=on", 0.5);
    harness_scene(&(struct pen_generated_options){.kind = PEN_GENERATED_HAIRBALL}, id);
    check_scene("hairball", id, "sky=on", 0.5);
    harness_scene(
        &(struct pen_generated_options){.kind = PEN_GENERATED_FOLIAGE, .triangles = 4000}, id);
    check_scene("leaves cut out by alpha", id, "sky=on", 0.5);
    harness_scene(&(struct pen_generated_options){.kind = PEN_GENERATED_FOLIAGE}, id);
    check_scene("foliage", id, "sky=on", 0.5);
    harness_scene(&(struct pen_generated_options){.kind = PEN_GENERATED_DEMO}, id);
    check_scene("demo", id, "sky=on", 0.5);
    check_panes();
    CHECK_DONE();
}
