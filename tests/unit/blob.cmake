penumbra_unit_test(blob_builder blob_builder.c LIBS penumbra_blob)
penumbra_unit_test(blob_geometry blob_geometry.c LIBS penumbra_blob)
penumbra_unit_test(blob_hostile blob_hostile.c LIBS penumbra_blob)
