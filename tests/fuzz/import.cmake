if(TARGET penumbra_import)
    # The library itself must carry the coverage, or the fuzzer is blind.
    target_compile_options(penumbra_import PRIVATE -fsanitize=fuzzer-no-link)
    penumbra_fuzz_test(import fuzz_import.c LIBS penumbra_import penumbra_blob)
endif()
