/* Checks the shape of a glTF document before anything relies on it: depth and size of the JSON, the
 * type and range of every property that the importer reads, and every index into another array. */
#pragma once
#include "protocol/error.h"
#include <stddef.h>

struct cJSON;
struct psc_builder;

/* Reads the text once, without recursion. Errors: PEN_INVALID (nested more than
 * IMP_MAX_JSON_DEPTH deep, unbalanced), PEN_TOO_BIG (more than IMP_MAX_JSON_VALUES values). */
bool imp_json_scan(const char *text, size_t bytes, struct pen_error *error);

/* Removes every member that the table does not know ("extras", foreign extensions ...), so that
 * nothing else reaches the parsers behind it. What can only mean that nothing is there is removed as
 * well: null, and with a warning an index of -1 and a sampler's mode that does not exist. Errors:
 * PEN_INVALID at the JSON pointer of the offending value, PEN_TOO_BIG for an array longer than
 * budget.h allows. */
bool imp_schema_check(struct cJSON *root, struct psc_builder *builder, struct pen_error *error);
