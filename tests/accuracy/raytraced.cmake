# Without tracing there is nothing to check.
if(TARGET penumbra_trace)
    penumbra_accuracy_test(raytraced)
endif()
