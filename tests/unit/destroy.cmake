# Every function of a header that is called x_destroy does nothing when there is nothing: the test is
# made of their declarations, so it has the next one too.
if(PENUMBRA_DAEMON)
    file(GLOB_RECURSE headers CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/server/*.h
        ${CMAKE_SOURCE_DIR}/renderer/*.h)
    if(NOT TARGET penumbra_trace)
        list(FILTER headers EXCLUDE REGEX "renderer/trace/")
    endif()
    set(includes "")
    set(calls "")
    foreach(header ${headers})
        set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${header})
        file(STRINGS ${header} declared REGEX "^void [a-z_]+_destroy\\(struct ")
        file(RELATIVE_PATH name ${CMAKE_SOURCE_DIR} ${header})
        foreach(line ${declared})
            string(REGEX REPLACE "^void ([a-z_]+).*" "\\1" function "${line}")
            string(REGEX MATCH "," second "${line}")
            string(APPEND includes "#include \"${name}\"\n")
            string(REPLACE "," ", NULL" second "${second}")
            string(APPEND calls "    puts(\"${function}\");\n    ${function}(NULL${second});\n")
        endforeach()
    endforeach()
    file(CONFIGURE OUTPUT ${CMAKE_CURRENT_BINARY_DIR}/destroy.c @ONLY CONTENT
"${includes}#include <stdio.h>

int main(void)
{
    setvbuf(stdout, NULL, _IOLBF, 0); /* the last line is the function that crashed */
${calls}}
")
    penumbra_unit_test(destroy ${CMAKE_CURRENT_BINARY_DIR}/destroy.c
        ${CMAKE_SOURCE_DIR}/server/workers/worker_encoder.c
        ${CMAKE_SOURCE_DIR}/server/workers/worker_item.c
        ${CMAKE_SOURCE_DIR}/server/workers/worker_measure.c ${CMAKE_SOURCE_DIR}/server/workers/worker_turns.c
        LIBS penumbra_server penumbra_renderer penumbra_encode penumbra_metrics)
endif()
