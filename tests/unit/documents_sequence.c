/* Sequences: keyframes against closed forms, views, turntables, and what is refused. */
#include "protocol/json_request.h"
#include "protocol/json_sequence.h"
#include "protocol/keyframes.h"
#include "tests/unit/check.h"
#include "tests/unit/documents_catalogue.h"

static const char scene[] =
    "\"scene\":\"0000000000000000000000000000000000000000000000000000000000000001\",";

static struct pen_sequence *read(const char *rest, struct pen_error *error)
{
    char text[4096];
    snprintf(text, sizeof text, "{%s%s}", scene, rest);
    return pen_sequence_from_json(text, strlen(text), &fake_catalogue, NULL, true, error);
}

/* ---- curves ---- */

static void linear_is_straight(void)
{
    const double places[] = {0, 2, 10}, values[] = {1, 5, -3};
    CHECK_NEAR(pen_keyframes_at(places, values, 3, false, 0.5), 2, 1e-12);
    CHECK_NEAR(pen_keyframes_at(places, values, 3, false, 6), 1, 1e-12);
    for (int cubic = 0; cubic < 2; cubic++) {
        for (int k = 0; k < 3; k++) /* through every key */
            CHECK(pen_keyframes_at(places, values, 3, cubic, places[k]) == values[k]);
        CHECK(pen_keyframes_at(places, values, 3, cubic, -4) == 1); /* still outside */
        CHECK(pen_keyframes_at(places, values, 3, cubic, 11) == -3);
        CHECK(pen_keyframes_at(places, values, 1, cubic, 5) == 1);
    }
}

/* Slopes that are differences over the neighbours are right for a parabola on even places, and with
 * both slopes right a cubic Hermite piece is the parabola itself. Of a straight line every slope is
 * right, on any places. */
static void cubic_has_closed_forms(void)
{
    double places[7], parabola[7], line[7];
    for (int i = 0; i < 7; i++) {
        places[i] = 3 * i;
        parabola[i] = 2 * places[i] * places[i] - 5 * places[i] + 1;
    }
    for (double x = 3; x <= 15; x += 0.25)
        CHECK_NEAR(pen_keyframes_at(places, parabola, 7, true, x), 2 * x * x - 5 * x + 1, 1e-9);
    for (int i = 0; i < 7; i++) {
        places[i] = i * i;
        line[i] = 7 - 3 * places[i];
    }
    for (double x = 0; x <= 36; x += 0.5)
        CHECK_NEAR(pen_keyframes_at(places, line, 7, true, x), 7 - 3 * x, 1e-9);
}

/* On even places, the spline of Catmull and Rom in the form of their paper's matrix. */
static void cubic_is_catmull_rom(void)
{
    const double places[] = {0, 1, 2, 3}, p[] = {0.3, -1, 4, 2.5};
    for (double t = 0; t <= 1; t += 0.125) {
        double spline =
            0.5 * (2 * p[1] + (p[2] - p[0]) * t + (2 * p[0] - 5 * p[1] + 4 * p[2] - p[3]) * t * t +
                      (3 * p[1] - p[0] - 3 * p[2] + p[3]) * t * t * t);
        CHECK_NEAR(pen_keyframes_at(places, p, 4, true, 1 + t), spline, 1e-12);
    }
}

/* ---- frames ---- */

static void a_turntable_goes_around(void)
{
    struct pen_error error = {0};
    struct pen_request request;
    struct pen_sequence *s = read("\"sequence\":{\"frames\":8,\"turntable\":{\"elevation_deg\":20,"
                                  "\"azimuth_deg\":10,\"distance\":3}}",
        &error);
    CHECK(s && s->options.frames == 8);
    for (uint32_t i = 0; s && i < 8; i++) {
        pen_sequence_frame(s, i, &request);
        CHECK(request.camera.mode == PEN_CAMERA_ORBIT);
        double turn = remainder((double)request.camera.azimuth_deg - (10 + 45. * i), 360);
        CHECK_NEAR(turn, 0, 1e-4);
        CHECK_NEAR(request.camera.elevation_deg, 20, 0);
        CHECK_NEAR(request.camera.distance, 3, 0);
        CHECK(request.scene[PEN_ID_BYTES - 1] == 1);
    }
    pen_sequence_destroy(s);
}

/* A frame's struct is that of the request for its view, so that its picture and its tag are. */
static void a_view_is_the_request_for_it(void)
{
    static const char *const views[] = {"{\"eye\":[1,2,3],\"fov_y_deg\":30}",
        "{\"orbit\":{\"azimuth_deg\":5}}", "{\"index\":1}", "{}"};
    char text[1024];
    struct pen_error error = {0};
    snprintf(text, sizeof text, "\"width\":99,\"sequence\":{\"views\":[%s,%s,%s,%s]}", views[0],
        views[1], views[2], views[3]);
    struct pen_sequence *s = read(text, &error);
    CHECK(s && s->options.frames == 4);
    for (uint32_t i = 0; s && i < 4; i++) {
        struct pen_request frame, alone;
        snprintf(text, sizeof text, "{\"width\":99,\"camera\":%s}", views[i]);
        CHECK(pen_request_from_json(text, strlen(text), &fake_catalogue, &alone, &error));
        pen_sequence_frame(s, i, &frame);
        memset(frame.scene, 0, sizeof frame.scene);
        CHECK(!memcmp(&frame, &alone, sizeof frame));
    }
    pen_sequence_destroy(s);
}

static void keyframes_move_what_they_name(void)
{
    struct pen_error error = {0};
    struct pen_request r;
    struct pen_sequence *s = read(
        "\"sequence\":{\"keyframes\":["
        "{\"frame\":2,\"camera\":{\"eye\":[0,0,4],\"fov_y_deg\":20}},"
        "{\"frame\":4,\"lights\":[{\"type\":\"sphere\",\"position\":[0,2,0],\"power_w\":10}]},"
        "{\"frame\":6,\"camera\":{\"eye\":[4,0,0],\"fov_y_deg\":60}},"
        "{\"frame\":8,\"lights\":[{\"type\":\"sphere\",\"position\":[0,4,0],\"power_w\":30}]}]}",
        &error);
    CHECK(s && s->options.frames == 9 && pen_sequence_moves_lights(s));
    pen_sequence_frame(s, 0, &r); /* before the first: still */
    CHECK(r.camera.eye[2] == 4 && r.lights[0].position[1] == 2 && r.light_count == 1);
    pen_sequence_frame(s, 4, &r);
    CHECK_NEAR(r.camera.eye[0], 2, 1e-12);
    CHECK_NEAR(r.camera.eye[2], 2, 1e-12);
    CHECK_NEAR((double)r.camera.fov_y_deg, 40, 1e-5);
    pen_sequence_frame(s, 7, &r); /* each between its own keys */
    CHECK(r.camera.eye[0] == 4);
    CHECK_NEAR(r.lights[0].position[1], 3.5, 1e-12);
    CHECK_NEAR((double)r.lights[0].power_w, 25, 1e-5);
    CHECK(r.lights[0].type == PEN_LIGHT_SPHERE);
    pen_sequence_destroy(s);
}

/* A cubic goes beyond its keys where it may, and a power does not become negative, or the 0 that
 * stands for something else. */
static void a_curve_leaves_its_range_only_where_it_may(void)
{
    struct pen_error error = {0};
    struct pen_request r;
    double low = 100, most = 0;
    struct pen_sequence *s =
        read("\"sequence\":{\"interpolation\":\"cubic\",\"keyframes\":["
             "{\"frame\":0,\"lights\":[{\"position\":[1,9,0],\"power_w\":100}]},"
             "{\"frame\":10,\"lights\":[{\"position\":[1,1,0],\"power_w\":1}]},"
             "{\"frame\":20,\"lights\":[{\"position\":[1,1,0],\"power_w\":1}]},"
             "{\"frame\":30,\"lights\":[{\"position\":[1,9,0],\"power_w\":100}]}]}",
            &error);
    CHECK(s);
    for (uint32_t i = 10; s && i <= 20; i++) {
        pen_sequence_frame(s, i, &r);
        low = fmin(low, r.lights[0].position[1]);
        most = fmax(most, fabs((double)r.lights[0].power_w - 1));
    }
    CHECK_NEAR(low, 0, 1e-9); /* 1 - 2 * 10 * 0.4 / 8, half way */
    CHECK_NEAR(most, 0, 0);
    pen_sequence_destroy(s);
}

static void an_animation_takes_its_time(void)
{
    struct pen_error error = {0};
    struct pen_request r;
    struct pen_sequence *s =
        read("\"animation\":\"walk\",\"time_s\":0.5,\"sequence\":{\"frames\":5,\"fps\":8}", &error);
    CHECK(s);
    pen_sequence_frame(s, 4, &r);
    CHECK_NEAR((double)r.time_s, 1, 0);
    pen_sequence_destroy(s);
    s = read("\"time_s\":0.5,\"sequence\":{\"frames\":5,\"fps\":8}", &error);
    pen_sequence_frame(s, 4, &r);
    CHECK_NEAR((double)r.time_s, 0.5, 0); /* nothing moves */
    CHECK(!pen_sequence_moves_lights(s));
    pen_sequence_destroy(s);
}

static void refused(void)
{
    static const struct {
        const char *text, *pointer;
    } rows[] = {
        {"\"sequence\":3", "/sequence"},
        {"\"sequence\":{},\"sequence\":{}", "/sequence"},
        {"\"sequence\":{\"frames\":2,\"views\":[{}]}", "/sequence/frames"},
        {"\"sequence\":{\"views\":[]}", "/sequence/views"},
        {"\"sequence\":{\"views\":[{},{\"eye\":[0,0,0],\"target\":[0,0,0]}]}", NULL},
        {"\"sequence\":{\"turntable\":{},\"turntable\":{}}", "/sequence/turntable"},
        {"\"sequence\":{\"keyframes\":[{\"frame\":1}]}", "/sequence/keyframes/0"},
        {"\"sequence\":{\"keyframes\":[{\"frame\":0.5,\"camera\":{\"eye\":[1,1,1]}}]}",
            "/sequence/keyframes/0"},
        {"\"sequence\":{\"keyframes\":[{\"frame\":1,\"width\":3,\"camera\":{\"eye\":[1,1,1]}}]}",
            "/sequence/keyframes/0"},
        {"\"sequence\":{\"keyframes\":[{\"frame\":0,\"camera\":{\"orbit\":{\"distance\":2}}},"
         "{\"frame\":1,\"camera\":{\"orbit\":{}}}]}",
            "/sequence/keyframes/1"},
        {"\"sequence\":{\"keyframes\":[{\"frame\":0,\"camera\":{\"orbit\":{}}},"
         "{\"frame\":1,\"camera\":{\"eye\":[1,1,1]}}]}",
            "/sequence/keyframes/1"},
        {"\"sequence\":{\"keyframes\":[{\"frame\":0,\"lights\":[{}]},{\"frame\":1,\"lights\":[]}]}",
            "/sequence/keyframes/1"},
        {"\"sequence\":{\"keyframes\":[{\"frame\":0,\"lights\":[{}]},"
         "{\"frame\":1,\"lights\":[{\"type\":\"sun\"}]}]}",
            "/sequence/keyframes/1"},
        {"\"sequence\":{\"keyframes\":[{\"frame\":0,\"lights\":[{}]},"
         "{\"frame\":1,\"lights\":[{\"radiance\":3}]}]}",
            "/sequence/keyframes/1"},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct pen_error error = {0};
        struct pen_sequence *s = read(rows[i].text, &error);
        CHECK(!s && error.code == PEN_INVALID);
        if (rows[i].pointer)
            CHECK_STR(error.pointer, rows[i].pointer);
        pen_sequence_destroy(s);
    }
    struct pen_error error = {0};
    CHECK(!pen_sequence_from_json("{}", 2, &fake_catalogue, NULL, true, &error));
    CHECK_STR(error.pointer, "/scene");
}

int main(void)
{
    linear_is_straight();
    cubic_has_closed_forms();
    cubic_is_catmull_rom();
    a_turntable_goes_around();
    a_view_is_the_request_for_it();
    keyframes_move_what_they_name();
    a_curve_leaves_its_range_only_where_it_may();
    an_animation_takes_its_time();
    refused();
    CHECK_DONE();
}
