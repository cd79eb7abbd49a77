if(TARGET penumbra_import)
    find_package(meshoptimizer REQUIRED)
    add_library(test_import_support STATIC import_support.c)
    target_link_libraries(test_import_support PUBLIC penumbra_import penumbra_blob)
    penumbra_unit_test(import_accessor import_accessor.c
        LIBS test_import_support meshoptimizer::meshoptimizer)
endif()
