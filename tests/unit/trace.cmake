if(TARGET penumbra_trace)
    penumbra_unit_test(trace_closed_forms trace_closed_forms.c LIBS penumbra_trace penumbra_blob m)
    penumbra_unit_test(trace_rules trace_rules.c LIBS penumbra_trace penumbra_blob m)
    penumbra_unit_test(trace_jobs trace_jobs.c LIBS penumbra_trace penumbra_embree
        penumbra_blob m)
    penumbra_unit_test(trace_shown trace_shown.c LIBS penumbra_trace penumbra_blob m)
endif()
