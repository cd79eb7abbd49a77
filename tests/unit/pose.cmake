# Poses of small files and of those in the shared folder, compared with an evaluation of its own.
find_package(Python3 COMPONENTS Interpreter)
if(TARGET penumbra_import)
    penumbra_unit_test(pose pose.c LIBS test_import_support penumbra_pose)
endif()
if(TARGET penumbra_import AND Python3_FOUND)
    add_executable(pose_dump pose_dump.c)
    target_link_libraries(pose_dump PRIVATE penumbra_flags penumbra_import penumbra_pose)
    add_test(NAME unit.pose_compare COMMAND ${Python3_EXECUTABLE}
        ${CMAKE_CURRENT_SOURCE_DIR}/pose_compare.py $<TARGET_FILE:pose_dump>)
    set_tests_properties(unit.pose_compare PROPERTIES LABELS unit TIMEOUT 300)
endif()
