# Target dist: ipminmax-<version>.tar.gz of what is committed, the same bits for the same commit. Runs as a script with
# SOURCE, BINARY and VERSION.
execute_process(COMMAND git -C "${SOURCE}" rev-parse --show-toplevel OUTPUT_VARIABLE top RESULT_VARIABLE failed
                OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
file(REAL_PATH "${SOURCE}" source)
if(failed OR NOT top STREQUAL source)
  message(FATAL_ERROR "dist packs what git knows, and ${SOURCE} is not the top of a git checkout")
endif()
execute_process(COMMAND git -C "${SOURCE}" status --porcelain OUTPUT_VARIABLE changed)
if(changed)
  message(WARNING "What is not committed is not packed:\n${changed}")
endif()
set(name "ipminmax-${VERSION}")
execute_process(  # times and owners are the commit's; -n: no time in gzip's header
  COMMAND git -C "${SOURCE}" archive --format=tar "--prefix=${name}/" HEAD
  COMMAND gzip -9n OUTPUT_FILE "${BINARY}/${name}.tar.gz" RESULTS_VARIABLE results)
if(NOT results STREQUAL "0;0")
  message(FATAL_ERROR "git archive or gzip failed: ${results}")
endif()
file(SHA256 "${BINARY}/${name}.tar.gz" digest)
file(SIZE "${BINARY}/${name}.tar.gz" size)
message(STATUS "${BINARY}/${name}.tar.gz: ${size} bytes, sha256 ${digest}")
