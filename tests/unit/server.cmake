# The front end's parts, without HTTP and without a renderer.
if(PENUMBRA_DAEMON)
    foreach(part file jobs scheduler fairness turns overload homes multipart cache store settings channel auto
            framing link places)
        penumbra_unit_test(server_${part} ${CMAKE_CURRENT_LIST_DIR}/server_${part}.c
            LIBS penumbra_server)
        set_tests_properties(unit.server_${part} PROPERTIES
            ENVIRONMENT "TSAN_OPTIONS=suppressions=${CMAKE_SOURCE_DIR}/tests/tsan.supp")
    endforeach()
    penumbra_unit_test(catalogue ${CMAKE_CURRENT_LIST_DIR}/catalogue.c
        LIBS penumbra_server penumbra_renderer)
    # A daemon that no driver may take down does not load one. Sanitizers bring libraries of their own.
    if(NOT PENUMBRA_SANITIZE)
        add_test(NAME unit.penumbrad_links COMMAND bash -c
            "libraries=$(ldd '$<TARGET_FILE:penumbrad>') && ! grep -E 'embree|GL|OSMesa|tbb|OpenEXR|tiff|stdc[+]' <<<\"$libraries\"")
        set_tests_properties(unit.penumbrad_links PROPERTIES LABELS unit TIMEOUT 60)
    endif()
endif()
