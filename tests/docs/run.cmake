# Runs PROGRAM (with arguments, separated by |): it has to succeed and print what the file EXPECTED holds
# (anything when it is empty).
string(REPLACE "|" ";" command "${PROGRAM}")
execute_process(COMMAND ${command} RESULT_VARIABLE result OUTPUT_VARIABLE output
                ERROR_VARIABLE errors)
file(READ "${EXPECTED}" expected)
if(NOT result EQUAL 0)
  message(FATAL_ERROR "${command} ended with ${result}:\n${output}${errors}")
endif()
if(NOT expected STREQUAL "" AND NOT output STREQUAL expected)
  message(FATAL_ERROR "The page shows\n${expected}but ${command} prints\n${output}")
endif()
