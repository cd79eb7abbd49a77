/* What programs without a renderer know of the methods is what the methods say of themselves. */
#include "protocol/json_request.h"
#include "renderer/catalogue/catalogue.h"
#include "renderer/renderer.h"
#include "server/auto/choice.h"
#include "tests/unit/check.h"

static void check_list(const char *const *a, const char *const *b)
{
    CHECK(!a == !b);
    for (; a && b && *a && *b; a++, b++)
        CHECK_STR(*a, *b);
    CHECK(!a || !b || (!*a && !*b));
}

static void check_param(const struct pen_param *a, const struct pen_param *b)
{
    CHECK_STR(a->name, b->name);
    CHECK_STR(a->help, b->help);
    CHECK(!a->unit == !b->unit);
    if (a->unit && b->unit)
        CHECK_STR(a->unit, b->unit);
    check_list(a->choices, b->choices);
    CHECK(!memcmp(a->def_v, b->def_v, sizeof a->def_v));
    CHECK(a->min == b->min && a->max == b->max && a->applies == b->applies);
    CHECK(a->offset == b->offset && a->type == b->type && a->count == b->count);
    CHECK(a->specialise == b->specialise && a->exclusive_min == b->exclusive_min);
}

/* A bare name of both request and method: its words are the method's. */
static void check_shared_name(void)
{
    struct pen_query_pair pairs[] = {{"technique", "erosion"}, {"variant", "direct"}};
    struct pen_request request;
    struct pen_error error = {0};
    CHECK(pen_request_from_query(pairs, 2, &pen_catalogue, &request, &error));
    CHECK(!request.variant[0]);
    const struct pen_technique_info *info = pen_catalogue_find(&pen_catalogue, "erosion");
    const struct pen_param *row = pen_param_find(info->params, "variant");
    CHECK(pen_param_load(row, request.technique_params, 0) ==
          pen_choice_index(row->choices, "direct"));
    pairs[1].value = "night";
    CHECK(pen_request_from_query(pairs, 2, &pen_catalogue, &request, &error));
    CHECK_STR(request.variant, "night");
}

int main(void)
{
    const struct pen_catalogue *real = pen_renderer_catalogue();
    CHECK(real->count == pen_catalogue.count);
    for (uint32_t i = 0; i < real->count && i < pen_catalogue.count; i++) {
        const struct pen_technique_info *a = pen_catalogue.items[i], *b = real->items[i];
        CHECK_STR(a->name, b->name);
        CHECK_STR(a->title, b->title);
        CHECK_STR(a->summary, b->summary);
        CHECK_STR(a->citation, b->citation);
        CHECK_STR(a->artefacts, b->artefacts);
        CHECK(a->cost_class == b->cost_class && a->textured == b->textured);
        CHECK(a->struct_size == b->struct_size && a->params.count == b->params.count);
        for (uint32_t r = 0; r < a->params.count && r < b->params.count; r++)
            check_param(&a->params.rows[r], &b->params.rows[r]);
        check_list(a->candidates, b->candidates);
        CHECK(a->candidates_need_gpu == b->candidates_need_gpu);
    }
    check_shared_name();
    /* Every candidate of "auto" is one that it can take, and there is room for all. */
    char keys[AUTO_MAX_ROWS][AUTO_KEY_BYTES];
    uint32_t count = auto_candidates(&pen_catalogue, false, false, keys);
    CHECK(count > 10 && count < AUTO_MAX_ROWS);
    for (uint32_t i = 0; i < count; i++) {
        struct pen_request request = {0};
        CHECK(auto_apply(keys[i], &pen_catalogue, &request));
    }
    CHECK_DONE();
}
