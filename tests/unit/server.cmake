# The front end's parts, without HTTP and without a renderer.
if(PENUMBRA_DAEMON)
    foreach(part file scheduler multipart cache store settings channel auto)
        penumbra_unit_test(server_${part} ${CMAKE_CURRENT_LIST_DIR}/server_${part}.c
            LIBS penumbra_server)
        set_tests_properties(unit.server_${part} PROPERTIES
            ENVIRONMENT "TSAN_OPTIONS=suppressions=${CMAKE_SOURCE_DIR}/tests/tsan.supp")
    endforeach()
endif()
