penumbra_unit_test(cull cull.c LIBS penumbra_renderer)
penumbra_unit_test(pick pick.c LIBS penumbra_renderer)
