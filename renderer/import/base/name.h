#pragma once
#include "protocol/limits.h"

/* The first name that is not empty, cut at a character's end, without control characters. */
void imp_name(char to[PEN_NAME_BYTES], const char *preferred, const char *otherwise);
