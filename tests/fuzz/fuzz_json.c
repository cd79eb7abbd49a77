/* Any bytes as a request body, or (first byte 'q') as lines "key=value" of a query, or (first byte
 * 'c') as the body of a comparison, or (first byte 's') of a sequence, each of whose frames is a
 * request. What is accepted must print to a body that reads back as the
 * same request; what is refused must say why. */
#include "protocol/json_compare.h"
#include "protocol/json_request.h"
#include "protocol/json_result.h"
#include "protocol/json_scan.h"
#include "protocol/json_sequence.h"
#include "tests/unit/documents_catalogue.h"
#include <stdlib.h>
#include <string.h>

#define REQUIRE(condition)                                                                         \
    do {                                                                                           \
        if (!(condition))                                                                          \
            abort();                                                                               \
    } while (0)

static bool read_query(char *text, struct pen_request *request, struct pen_error *error)
{
    struct pen_query_pair pairs[300];
    uint32_t count = 0;
    for (char *at = text; at && *at && count < 300;) {
        char *next = strchr(at, '\n');
        if (next)
            *next++ = 0;
        char *equals = strchr(at, '=');
        if (equals)
            *equals++ = 0;
        pairs[count++] = (struct pen_query_pair){at, equals};
        at = next;
    }
    return pen_request_from_query(pairs, count, &fake_catalogue, request, error);
}

static void check_compare(const char *text, size_t bytes)
{
    static struct pen_compare compare;
    struct pen_error error = {0};
    bool ok = pen_compare_from_json(text, bytes, &fake_catalogue, "none", &compare, &error);
    REQUIRE(ok == (error.code == PEN_OK));
    REQUIRE(!ok || (compare.count >= 1 && compare.count <= PEN_COMPARE_METHODS));
    REQUIRE(ok || (pen_code_blame(error.code) == PEN_BLAME_CALLER && error.message[0]));
}

static void check_round_trip(const struct pen_request *request)
{
    struct pen_request back;
    struct pen_error error = {0};
    char *text = pen_request_json(request, &fake_catalogue);
    REQUIRE(pen_request_from_json(text, strlen(text), &fake_catalogue, &back, &error));
    REQUIRE(!memcmp(request, &back, sizeof back));
    free(text);
}

static void check_sequence(const char *text, size_t bytes)
{
    struct pen_error error = {0};
    struct pen_sequence *s =
        pen_sequence_from_json(text, bytes, &fake_catalogue, "none", false, &error);
    REQUIRE((s != NULL) == (error.code == PEN_OK));
    REQUIRE(s || (pen_code_blame(error.code) == PEN_BLAME_CALLER && error.message[0]));
    for (uint32_t i = 0; s && i < s->options.frames; i += 1 + s->options.frames / 8) {
        struct pen_request request;
        pen_sequence_frame(s, i, &request);
        check_round_trip(&request);
    }
    pen_sequence_destroy(s);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct pen_request request;
    struct pen_error error = {0};
    bool ok;
    if (size && data[0] == 'c') {
        check_compare((const char *)data + 1, size - 1);
        return 0;
    }
    if (size && data[0] == 's') {
        check_sequence((const char *)data + 1, size - 1);
        return 0;
    }
    if (size && data[0] == 'q') {
        char *text = malloc(size);
        memcpy(text, data + 1, size - 1);
        text[size - 1] = 0;
        ok = read_query(text, &request, &error);
        free(text);
    } else
        ok = pen_request_from_json((const char *)data, size, &fake_catalogue, &request, &error);
    REQUIRE(ok == (error.code == PEN_OK));
    if (!ok) {
        struct pen_error nothing = {0};
        REQUIRE(pen_code_blame(error.code) == PEN_BLAME_CALLER && error.message[0]);
        char *problem = pen_problem_json(&error, 422, "", false, NULL);
        REQUIRE(pen_json_scan(problem, strlen(problem), 32, &nothing));
        free(problem);
        return 0;
    }
    check_round_trip(&request);
    return 0;
}
