penumbra_unit_test(memory memory.c LIBS penumbra_protocol)
