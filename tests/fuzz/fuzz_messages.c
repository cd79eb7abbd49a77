/* Any bytes as what a worker says of a picture: it is refused, or can be told to a client in every way
 * that there is. */
#include "protocol/json_result.h"
#include "tests/unit/documents_catalogue.h"
#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

/* A sound one, so that a few changed bytes are enough to get far. */
static void make_sound(struct pen_result *result)
{
    memset(result, 0, sizeof *result);
    pen_request_default(&result->completed, &fake_catalogue);
    result->completed.light_count = 2;
    result->pass_count = 3;
    result->warning_count = 1;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static struct pen_result result;
    char timing[512];
    make_sound(&result);
    /* Runs of bytes: where they go (3), how many there are (1), they. */
    while (size >= 4) {
        size_t at = (data[0] | data[1] << 8 | (size_t)data[2] << 16) % sizeof result,
               bytes = data[3];
        data += 4, size -= 4;
        bytes = bytes < size ? bytes : size;
        bytes = bytes < sizeof result - at ? bytes : sizeof result - at;
        memcpy((char *)&result + at, data, bytes);
        data += bytes, size -= bytes;
    }
    if (!pen_result_receive(&result, &fake_catalogue))
        return 0;
    struct pen_record_extra extra = {0};
    free(pen_result_json(&result, &extra, &fake_catalogue));
    free(pen_problem_json(&result.error, 500, "", false, NULL));
    pen_server_timing(&result, 1, timing, sizeof timing);
    return 0;
}
