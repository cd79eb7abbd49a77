penumbra_unit_test(metrics metrics.c LIBS penumbra_metrics m)

# The same metrics by direct sums in another language.
find_package(Python3 COMPONENTS Interpreter)
if(Python3_FOUND)
    add_executable(metrics_dump metrics_dump.c)
    target_link_libraries(metrics_dump PRIVATE penumbra_flags penumbra_metrics m)
    add_test(NAME unit.metrics_direct COMMAND ${Python3_EXECUTABLE}
        ${CMAKE_CURRENT_SOURCE_DIR}/metrics.py $<TARGET_FILE:metrics_dump>)
    set_tests_properties(unit.metrics_direct PROPERTIES LABELS unit TIMEOUT 600)
endif()
