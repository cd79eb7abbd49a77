# Writes PAGE, the manual of the program NAME in SECTION, from the --help of PROGRAM: whatever a program
# says of itself is written once. cmake -DPROGRAM=... -P manual.cmake
# Text for roff; hyphens as they are typed, and no line a request.
function(roff text out)
    string(REPLACE "\\" "\\e" text "${text}")
    string(REPLACE "-" "\\-" text "${text}")
    string(REGEX REPLACE "(^|\n)([.'])" "\\1\\\\&\\2" text "${text}")
    set(${out} "${text}" PARENT_SCOPE)
endfunction()

# What "PROGRAM --help" prints, as a block that keeps its lines.
function(help out)
    execute_process(COMMAND ${PROGRAM} --help OUTPUT_VARIABLE text RESULT_VARIABLE status)
    if(status)
        message(FATAL_ERROR "${NAME} --help ends with ${status}")
    endif()
    roff("${text}" text)
    set(${out} ".nf\n${text}.fi\n" PARENT_SCOPE)
endfunction()

roff("${NAME}" name)
roff("${SUMMARY}" summary)
help(text)
set(page ".TH ${NAME} ${SECTION} \"\" \"penumbra ${VERSION}\"\n.SH NAME\n${name} \\- ${summary}\n")
string(APPEND page ".SH DESCRIPTION\n${text}")
string(APPEND page ".SH SEE ALSO\n.BR penumbra (1)\n")
file(WRITE ${PAGE} "${page}")
