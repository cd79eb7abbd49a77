/* What is known of every registered method without OpenGL and without Embree: for programs that list
 * and check, but do not render. The rows are those of the methods themselves, copied at build time
 * by write_catalogue.c; device.h, which needs neither, comes with them. */
#pragma once
#include "protocol/technique_info.h"

extern const struct pen_catalogue pen_catalogue;
