# deploy/
add_test(NAME unit.contact_sheet
    COMMAND python3 -B ${CMAKE_CURRENT_SOURCE_DIR}/contact_sheet_test.py)
set_tests_properties(unit.contact_sheet PROPERTIES LABELS unit TIMEOUT 600)
