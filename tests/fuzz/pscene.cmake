penumbra_fuzz_test(pscene fuzz_pscene.c LIBS penumbra_generate)
