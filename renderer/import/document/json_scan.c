#include "renderer/import/base/budget.h"
#include "renderer/import/document/schema.h"

bool imp_json_scan(const char *text, size_t bytes, struct pen_error *error)
{
    unsigned depth = 0;
    size_t values = 0;
    for (size_t i = 0; i < bytes; i++) {
        switch (text[i]) {
        case '"':
            for (i++; i < bytes && text[i] != '"'; i++)
                i += text[i] == '\\';
            break;
        case '[':
        case '{':
            if (++depth > IMP_MAX_JSON_DEPTH)
                return pen_fail(error, PEN_INVALID, "",
                    "The glTF's JSON is nested more than %d deep.", IMP_MAX_JSON_DEPTH);
            values++;
            break;
        case ']':
        case '}':
            if (!depth--)
                return pen_fail(error, PEN_INVALID, "", "The glTF's JSON is not balanced.");
            break;
        case ',':
            values++;
            break;
        case 0:
            return pen_fail(error, PEN_INVALID, "", "The glTF's JSON holds a zero byte.");
        }
    }
    if (depth)
        return pen_fail(error, PEN_INVALID, "", "The glTF's JSON ends too early.");
    if (values > IMP_MAX_JSON_VALUES)
        return pen_fail(error, PEN_TOO_BIG, "", "The glTF's JSON holds more than %u values.",
            IMP_MAX_JSON_VALUES);
    return true;
}
