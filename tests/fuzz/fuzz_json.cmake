if(PENUMBRA_DAEMON)
    penumbra_fuzz_test(json fuzz_json.c ${CMAKE_SOURCE_DIR}/tests/unit/documents_catalogue.c
        LIBS penumbra_documents)
    penumbra_fuzz_test(messages fuzz_messages.c ${CMAKE_SOURCE_DIR}/tests/unit/documents_catalogue.c
        LIBS penumbra_documents)
endif()
