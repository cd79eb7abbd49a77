# The client against a stub of the server: command lines in, calls and exit codes out.
if(PENUMBRA_DAEMON)
    find_package(Python3 COMPONENTS Interpreter)
    if(Python3_FOUND)
        add_test(NAME api.cli COMMAND ${Python3_EXECUTABLE}
            ${CMAKE_SOURCE_DIR}/tests/api/test_cli.py $<TARGET_FILE:penumbra>)
        add_test(NAME api.cli_files COMMAND ${Python3_EXECUTABLE}
            ${CMAKE_SOURCE_DIR}/tests/api/test_cli_files.py $<TARGET_FILE:penumbra>)
        add_test(NAME api.cli_shell COMMAND ${Python3_EXECUTABLE}
            ${CMAKE_SOURCE_DIR}/tests/api/test_cli_shell.py $<TARGET_FILE:penumbra>)
        set_tests_properties(api.cli api.cli_files api.cli_shell PROPERTIES LABELS "api;smoke" TIMEOUT 600 RESOURCE_LOCK waiting)
    endif()
endif()
