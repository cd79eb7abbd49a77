penumbra_unit_test(cull cull.c LIBS penumbra_renderer)
penumbra_unit_test(cover cover.c LIBS penumbra_renderer)
