# A method from outside the tree: its .c, its .glsl, and one line after those of the registry. Only the
# registry's own file and the table of shaders are compiled again; the rest is the library as it is.
set(extra ${CMAKE_CURRENT_SOURCE_DIR}/out_of_tree)
set(shadow ${CMAKE_CURRENT_BINARY_DIR}/out_of_tree)
file(READ ${registry} lines)
file(CONFIGURE OUTPUT ${shadow}/renderer/techniques/registry.def
    CONTENT "${lines}TECHNIQUE(dimmed)\nTECHNIQUE(sample_probe)\n" @ONLY)
penumbra_shader_sources(${shadow}/gl_sources.c ${PENUMBRA_SHADERS} ${extra}/dimmed.glsl)
add_library(penumbra_extended OBJECT ${CMAKE_SOURCE_DIR}/renderer/registry.c ${extra}/dimmed.c
    ${extra}/sample_probe.c
    ${shadow}/gl_sources.c)
target_include_directories(penumbra_extended BEFORE PRIVATE ${shadow})
target_link_libraries(penumbra_extended PUBLIC penumbra_accuracy)
target_compile_definitions(penumbra_extended PRIVATE
    $<TARGET_PROPERTY:penumbra_renderer,COMPILE_DEFINITIONS>)
foreach(program check every_method classifier)
    set(file ${program}.c)
    if(program STREQUAL check)
        set(file out_of_tree/check.c)
    endif()
    add_executable(accuracy_out_of_tree_${program} ${file})
    target_link_libraries(accuracy_out_of_tree_${program} PRIVATE penumbra_extended)
    add_test(NAME accuracy.out_of_tree.${program}
        COMMAND accuracy_out_of_tree_${program} dimmed)
    set_tests_properties(accuracy.out_of_tree.${program} PROPERTIES LABELS accuracy TIMEOUT 1200
        SKIP_RETURN_CODE 77 RESOURCE_LOCK gpu)
endforeach()
