if(PENUMBRA_DAEMON)
    foreach(subject request query scan result openapi routes compare sequence)
        penumbra_unit_test(documents_${subject} documents_${subject}.c documents_catalogue.c
            LIBS penumbra_documents PkgConfig::cjson)
    endforeach()
endif()
