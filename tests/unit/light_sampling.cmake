penumbra_unit_test(light_tree light_tree.c LIBS penumbra_renderer)
penumbra_unit_test(cascades cascades.c LIBS penumbra_renderer)
