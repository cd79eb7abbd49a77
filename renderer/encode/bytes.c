#include "renderer/encode/bytes.h"
#include <stdlib.h>

void pen_bytes_finish(struct pen_bytes *bytes)
{
    free(bytes->data);
    *bytes = (struct pen_bytes){0};
}
