# renderer/encode: every format is read back with a decoder that is not the writer's.
if(PENUMBRA_DAEMON)
    pkg_check_modules(SPNG REQUIRED IMPORTED_TARGET spng)
    pkg_check_modules(TURBOJPEG REQUIRED IMPORTED_TARGET libturbojpeg)
    pkg_check_modules(WEBP REQUIRED IMPORTED_TARGET libwebp)
    penumbra_unit_test(encode_png encode/png_test.c LIBS penumbra_encode PkgConfig::SPNG)
    penumbra_unit_test(encode_formats encode/formats_test.c
        LIBS penumbra_encode PkgConfig::TURBOJPEG PkgConfig::WEBP Threads::Threads)

    add_executable(encode_sample encode/sample.c)
    target_link_libraries(encode_sample PRIVATE penumbra_flags penumbra_encode)
    add_test(NAME unit.encode_files
        COMMAND python3 ${CMAKE_CURRENT_SOURCE_DIR}/encode/check_files.py $<TARGET_FILE:encode_sample>)
    set_tests_properties(unit.encode_files PROPERTIES LABELS unit TIMEOUT 600)
    set_tests_properties(unit.encode_formats unit.encode_files PROPERTIES
        ENVIRONMENT "TSAN_OPTIONS=suppressions=${CMAKE_SOURCE_DIR}/tests/tsan.supp")
endif()
