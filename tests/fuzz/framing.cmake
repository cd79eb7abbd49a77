if(PENUMBRA_DAEMON)
    penumbra_fuzz_test(framing ${CMAKE_CURRENT_LIST_DIR}/fuzz_framing.c LIBS penumbra_server)
endif()
