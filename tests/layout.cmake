# The rooms of the core follow the data: no room includes one that comes after it, and none below parallel includes
# what the door offers (answer.hpp and its other names). Run with -DSOURCE_DIR=...
cmake_minimum_required(VERSION 3.22)
set(rooms formulas model differences robust point kkt method paper certificate diagnostics search sensitivity proof
    parallel global)
set(door answer gap multistart robust solver worst_case)
set(wrong "")

# Adds the includes of a folder's files that match to the wrong ones.
macro(forbid folder pattern)
  file(GLOB_RECURSE sources "${SOURCE_DIR}/${folder}/*.hpp" "${SOURCE_DIR}/${folder}/*.cpp")
  foreach(source ${sources})
    file(STRINGS "${source}" found REGEX "^#include \"${pattern}")
    foreach(line ${found})
      string(APPEND wrong "\n  ${source}: ${line}")
    endforeach()
  endforeach()
endmacro()

list(JOIN door "|" offered)
set(later ${rooms})
foreach(room ${rooms})
  list(REMOVE_ITEM later ${room})
  if(NOT room MATCHES "^(parallel|global)$")
    list(JOIN later "|" after)
    forbid("core/${room}" "core/((${after})/|(${offered})\\.hpp\")")
  endif()
endforeach()
forbid(linalg "(core|adapter)/")
forbid(core "adapter/")
if(wrong)
  message(FATAL_ERROR "Includes that run back:${wrong}")
endif()
