# LAPACK::LAPACK. liblapack and libblas by their plain names are the ones that MUMPS and Ipopt load:
# one BLAS in a process. BLA_VENDOR chooses another.
if(NOT DEFINED BLA_VENDOR)
  set(BLA_VENDOR Generic)
  find_package(LAPACK QUIET)
  unset(BLA_VENDOR)
endif()
if(NOT LAPACK_FOUND)
  find_package(LAPACK REQUIRED)
endif()
