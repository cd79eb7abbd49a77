# By the tracer on the CPU; rays.c has the shaders.
if(TARGET penumbra_trace)
    penumbra_accuracy_test(raytraced)
endif()
