#include "renderer/import/convert/context.h"
#include "protocol/fnv.h"
#include "renderer/import/base/budget.h"
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

void imp_warn(struct imp_context *context, const char *format, ...)
{
    char text[400];
    va_list args;
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    uint64_t h = pen_fnv(PEN_FNV_START, text, strlen(text));
    for (uint32_t i = 0; i < context->warned_count; i++)
        if (context->warned[i] == h)
            return;
    if (context->warned_count == IMP_MAX_WARNINGS)
        return;
    context->warned[context->warned_count++] = h;
    psc_builder_add_warning(context->builder, "%s", text);
}
