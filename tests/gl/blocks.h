/* What the rows of shared blocks call, file by file: see rows_layout.h and the generated file that
 * reads them all. */
#pragma once
#include "renderer/gl/gl.h"
#include <stddef.h>

bool layout_begin(const char *file); /* a program of that file alone */
void layout_structure(const char *name, size_t size);
void layout_block(GLenum kind, const char *name, int binding, size_t size);
void layout_field(const char *name, size_t offset, size_t stride);
void layout_array(const char *name, const char *type, size_t offset, size_t stride);
void layout_end(const char *instance);
void layout_finish(void);

void layout_all(void); /* generated */
