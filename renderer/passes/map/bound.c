#include "renderer/passes/map/bound.h"
#include "renderer/passes/draw/screen.h"
#include "renderer/passes/map/depth_map.h"
#include "renderer/passes/map/min_max.h"
#include "renderer/passes/map/shadow_cache.h"

bool pass_bound(struct technique_run *run, struct pen_error *error)
{
    uint32_t size = run->bound.map_size;
    if (!size)
        return true;
    bool windows = run->bound.window == BOUND_KERNEL || run->bound.window == BOUND_LIGHT;
    const struct shadow_input *map = pass_caster_map(run, size, error);
    const struct shadow_input *min_max =
        map && windows ? pass_caster_min_max(run, size, error) : NULL;
    if (!map || (windows && !min_max))
        return false;
    struct bound_block block = {.reach = {run->bound.texels, run->bound.pixels},
        .kind = {(int32_t)run->bound.window, (int32_t)run->light_index}};
    struct pass_texture textures[] = {{UNIT_SOURCE, run->vis->name, GL_SAMPLE_NEAREST},
        {UNIT_MIN_MAX, windows ? min_max->textures[0].name : 0, GL_SAMPLE_NEAREST}};
    gl.TextureBarrier(); /* the pass reads what it writes: each pixel its own, once */
    return pass_screen(run,
        &(struct pass_screen){.name = "bound",
            .body = "bound.glsl",
            .defines = windows ? "#define WINDOWS\n" : NULL,
            .shadow = &map->textures[0],
            .textures = textures,
            .texture_count = windows ? 2 : 1,
            .least = true,
            .tiles = run->tiles,
            .extra = &block,
            .extra_bytes = sizeof block},
        error);
}
