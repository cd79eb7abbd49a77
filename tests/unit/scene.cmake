penumbra_unit_test(pick pick.c LIBS penumbra_renderer)
