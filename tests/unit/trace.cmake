if(TARGET penumbra_trace)
    penumbra_unit_test(trace_closed_forms trace_closed_forms.c LIBS penumbra_trace penumbra_blob m)
endif()
