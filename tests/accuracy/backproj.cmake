penumbra_accuracy_test(backproj)
target_sources(accuracy_backproj PRIVATE textured.c)
