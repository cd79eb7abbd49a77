# By the tracer on the CPU; rays.c has the shaders.
if(TARGET penumbra_trace)
    penumbra_accuracy_test(raytraced)
    penumbra_accuracy_test(denoised)
    target_link_libraries(accuracy_denoised PRIVATE penumbra_textured)
endif()
