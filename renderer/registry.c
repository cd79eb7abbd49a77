/* Every method there is. */
#include "renderer/renderer.h"
#include "renderer/technique.h"

#define TECHNIQUE(name) extern const struct technique technique_##name;
#include "renderer/techniques/registry.def"
#undef TECHNIQUE
const struct technique *const technique_registry[] = {
#define TECHNIQUE(name) &technique_##name,
#include "renderer/techniques/registry.def"
#undef TECHNIQUE
    NULL};

#define TECHNIQUE(name) +1
enum {
    TECHNIQUE_COUNT = 0
#include "renderer/techniques/registry.def"
};
#undef TECHNIQUE

const struct pen_catalogue *pen_renderer_catalogue(void)
{
    static const struct pen_technique_info *const infos[] = {
#define TECHNIQUE(name) &technique_##name.info,
#include "renderer/techniques/registry.def"
#undef TECHNIQUE
    };
    static const struct pen_catalogue catalogue = {infos, TECHNIQUE_COUNT};
    return &catalogue;
}
