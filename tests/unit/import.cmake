if(TARGET penumbra_import)
    find_package(meshoptimizer REQUIRED)
    pkg_check_modules(import_test REQUIRED IMPORTED_TARGET spng libturbojpeg libwebp libzip)
    add_library(test_import_support STATIC import_support.c)
    target_link_libraries(test_import_support PUBLIC penumbra_import penumbra_blob
        PkgConfig::import_test meshoptimizer::meshoptimizer)
    foreach(part document accessor mesh node material files draco meshopt)
        penumbra_unit_test(import_${part} import_${part}.c LIBS test_import_support)
    endforeach()

    penumbra_unit_test(import_sandbox import_sandbox.c LIBS penumbra_sandbox)
    set(hostile_folder ${CMAKE_CURRENT_BINARY_DIR}/hostile)
    foreach(part process hostile)
        penumbra_unit_test(import_${part} import_${part}.c import_run.c LIBS penumbra_blob)
        target_compile_definitions(test_import_${part} PRIVATE
            IMPORTER="$<TARGET_FILE:penumbra-import>" SHARED="${CMAKE_SOURCE_DIR}/../shared"
            HOSTILE="${hostile_folder}")
        add_dependencies(test_import_${part} penumbra-import)
    endforeach()
    set_tests_properties(unit.import_process PROPERTIES SKIP_RETURN_CODE 77)

    find_package(Python3 REQUIRED COMPONENTS Interpreter)
    add_test(NAME unit.import_hostile_files COMMAND ${Python3_EXECUTABLE}
        ${CMAKE_SOURCE_DIR}/tests/api/hostile_files.py ${hostile_folder})
    set_tests_properties(unit.import_hostile_files PROPERTIES LABELS unit TIMEOUT 600
        FIXTURES_SETUP hostile_files)
    set_property(TEST unit.import_hostile PROPERTY FIXTURES_REQUIRED hostile_files)
endif()
