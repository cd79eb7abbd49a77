#include "protocol/memory.h"
#include "renderer/import/document/document.h"

uint8_t *imp_document_alloc(struct imp_document *document, size_t bytes)
{
    uint8_t *memory = pen_alloc_zero(bytes, 1);
    document->owned = pen_grow(document->owned, &document->owned_capacity,
        document->owned_count + 1, sizeof *document->owned);
    return document->owned[document->owned_count++] = memory;
}
