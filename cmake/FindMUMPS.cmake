# Sequential double precision MUMPS: target MUMPS::dmumps. MUMPS ships no package file of its own; libraries are called
# dmumps_seq (Debian, conda-forge), coinmumps (COIN-OR's, vcpkg's), or dmumps beside mpiseq, its stub of MPI (Spack
# without MPI, Homebrew). dmumps without that stub is the parallel one. -DMUMPS_ROOT=<prefix> comes first.
find_path(MUMPS_INCLUDE_DIR dmumps_c.h PATH_SUFFIXES mumps_seq mumps-seq coin-or/mumps coin/ThirdParty mumps)
find_library(MUMPS_DMUMPS_LIBRARY NAMES dmumps_seq coinmumps)
if(NOT MUMPS_DMUMPS_LIBRARY)
  find_library(MUMPS_MPISEQ_LIBRARY mpiseq)
  mark_as_advanced(MUMPS_MPISEQ_LIBRARY)
  if(MUMPS_MPISEQ_LIBRARY)
    find_library(MUMPS_DMUMPS_LIBRARY dmumps)
  endif()
endif()

include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(MUMPS REQUIRED_VARS MUMPS_DMUMPS_LIBRARY MUMPS_INCLUDE_DIR)
mark_as_advanced(MUMPS_DMUMPS_LIBRARY MUMPS_INCLUDE_DIR)
if(MUMPS_FOUND AND NOT TARGET MUMPS::dmumps)
  add_library(MUMPS::dmumps UNKNOWN IMPORTED)
  set_target_properties(MUMPS::dmumps PROPERTIES
    IMPORTED_LOCATION "${MUMPS_DMUMPS_LIBRARY}"
    INTERFACE_LINK_LIBRARIES "$<$<BOOL:${MUMPS_MPISEQ_LIBRARY}>:${MUMPS_MPISEQ_LIBRARY}>"
    INTERFACE_INCLUDE_DIRECTORIES "${MUMPS_INCLUDE_DIR}")
endif()
