if(TARGET penumbra_import)
    # The library itself must carry the coverage, or the fuzzer is blind.
    target_compile_options(penumbra_import PRIVATE -fsanitize=fuzzer-no-link)
    penumbra_fuzz_test(import fuzz_import.c LIBS penumbra_import penumbra_blob)

    # From random bytes it gets nowhere: a second run starts from small files, hostile and good.
    find_package(Python3 REQUIRED COMPONENTS Interpreter)
    set(seeds ${CMAKE_CURRENT_BINARY_DIR}/import_seeds)
    add_test(NAME fuzz.import_seeds_files COMMAND ${Python3_EXECUTABLE}
        ${CMAKE_SOURCE_DIR}/tests/api/hostile_files.py --seeds ${seeds})
    add_test(NAME fuzz.import_seeds COMMAND fuzz_import -seed=1 -runs=50000 -max_len=32768
        -dict=${CMAKE_CURRENT_SOURCE_DIR}/fuzz_import.dict -timeout=10 -rss_limit_mb=4096 ${seeds})
    set_tests_properties(fuzz.import_seeds_files PROPERTIES LABELS fuzz TIMEOUT 600
        FIXTURES_SETUP import_seeds)
    set_tests_properties(fuzz.import_seeds PROPERTIES LABELS fuzz TIMEOUT 1800
        FIXTURES_REQUIRED import_seeds)
endif()
