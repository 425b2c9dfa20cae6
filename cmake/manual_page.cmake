# Writes the manual page FILE from what PROGRAM says with --help: cmake -DPROGRAM=... -DFILE=... -P
execute_process(COMMAND "${PROGRAM}" --help OUTPUT_VARIABLE help COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND "${PROGRAM}" -= OUTPUT_VARIABLE options COMMAND_ERROR_IS_FATAL ANY)

# In roff a backslash, and a dot or quote that begins a line, mean something.
function(escape text result)
  string(REPLACE "\\" "\\\\" text "${text}")
  string(REPLACE "-" "\\-" text "${text}")
  string(REGEX REPLACE "(^|\n)([.'])" "\\1\\\\&\\2" text "${text}")
  set(${result} "${text}" PARENT_SCOPE)
endfunction()

escape("${help}" help)
escape("${options}" options)
string(REGEX REPLACE "^usage: ([^\n]*)\n" "" help "${help}")
set(usage "${CMAKE_MATCH_1}")
# A heading alone in its line begins a section.
string(REGEX REPLACE "\n([A-Z][A-Za-z ]*):\n" "\n.fi\n.SH \\1\n.nf\n" help "${help}")
file(WRITE "${FILE}" ".TH IPMINMAX 1
.SH NAME
ipminmax \\- interior\\-point solver for minmax problems in .nl files
.SH SYNOPSIS
${usage}
.SH DESCRIPTION
.nf
${help}.fi
.SH ALL OPTIONS
.nf
${options}.fi
")
