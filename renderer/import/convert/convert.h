/* From a glTF document to a scene blob. */
#pragma once
#include "renderer/blob/builder.h"
#include "renderer/import/document/document.h"
#include "renderer/import/document/gltf_tiny.h"

/* Everything: adds to `builder` what `model` draws. */
bool imp_convert(struct imp_document *document, struct gltf_model *model,
    struct psc_builder *builder, struct pen_error *error);
