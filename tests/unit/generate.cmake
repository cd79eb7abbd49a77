penumbra_unit_test(generate generate.c LIBS penumbra_generate)
penumbra_unit_test(generate_visibility generate_visibility.c LIBS penumbra_generate)

# Every scene in both forms, compared by a reader that shares no code with the writers.
find_package(Python3 COMPONENTS Interpreter)
if(Python3_FOUND)
    add_executable(generate_dump generate_dump.c)
    target_link_libraries(generate_dump PRIVATE penumbra_generate)
    add_test(NAME unit.generate_glb COMMAND ${Python3_EXECUTABLE}
        ${CMAKE_CURRENT_SOURCE_DIR}/generate_glb.py $<TARGET_FILE:generate_dump>)
    set_tests_properties(unit.generate_glb PROPERTIES LABELS unit TIMEOUT 600)
endif()
