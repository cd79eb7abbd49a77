penumbra_unit_test(trace_bvh trace_bvh.c LIBS penumbra_bvh penumbra_blob m)
