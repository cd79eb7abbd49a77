/* From a member to the struct that it is part of. */
#pragma once
#include <stddef.h>

#define container_of(member_pointer, type, member)                                                 \
    ((type *)((char *)(member_pointer)-offsetof(type, member)))
