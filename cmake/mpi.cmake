# IPMINMAX_WITH_MPI: whether libipminmax_mpi.so and ipminmax-worker are built, and the function that adds
# them. Nothing else is compiled with MPI or linked with it.
set(IPMINMAX_WITH_MPI FALSE)
if(NOT IPMINMAX_MPI STREQUAL "OFF")
  find_package(MPI COMPONENTS C)
  find_library(MUMPS_MPI_DMUMPS_LIBRARY dmumps)  # the sequential one is dmumps_seq
  mark_as_advanced(MUMPS_MPI_DMUMPS_LIBRARY)
  if(MPI_C_FOUND AND MUMPS_MPI_DMUMPS_LIBRARY)
    set(IPMINMAX_WITH_MPI TRUE)
  elseif(IPMINMAX_MPI STREQUAL "ON")
    message(FATAL_ERROR "IPMINMAX_MPI=ON needs MPI and the parallel MUMPS "
                        "(Debian: libopenmpi-dev, libmumps-dev)")
  else()
    message(STATUS "MPI or parallel MUMPS not found: no linear_solver mumps_mpi")
  endif()
else()
  message(STATUS "IPMINMAX_MPI is OFF: no linear_solver mumps_mpi")
endif()

# AddressSanitizer forbids RTLD_DEEPBIND, with which the plugin has to be loaded.
set(IPMINMAX_CAN_LOAD_MPI ${IPMINMAX_WITH_MPI})
if(CMAKE_CXX_FLAGS MATCHES "-fsanitize=[a-z,]*address")
  set(IPMINMAX_CAN_LOAD_MPI FALSE)
endif()

function(ipminmax_add_mpi_plugin)
  set(folder "${PROJECT_SOURCE_DIR}/linalg/mpi")
  add_library(ipminmax_mpi_objects OBJECT "${folder}/plugin.cpp" "${folder}/remote_mumps.cpp"
                                          "${folder}/session.cpp")
  target_include_directories(ipminmax_mpi_objects PUBLIC "${PROJECT_SOURCE_DIR}")
  target_include_directories(ipminmax_mpi_objects SYSTEM PRIVATE "${MUMPS_INCLUDE_DIR}")
  target_compile_definitions(ipminmax_mpi_objects PRIVATE OMPI_SKIP_MPICXX MPICH_SKIP_MPICXX)
  target_link_libraries(ipminmax_mpi_objects PRIVATE ipminmax_warnings MPI::MPI_C Threads::Threads)
  set_target_properties(ipminmax_mpi_objects PROPERTIES CXX_VISIBILITY_PRESET hidden)
  set(libraries "${MUMPS_MPI_DMUMPS_LIBRARY}" MPI::MPI_C Threads::Threads)

  add_library(ipminmax_mpi MODULE $<TARGET_OBJECTS:ipminmax_mpi_objects>)
  target_link_libraries(ipminmax_mpi PRIVATE ${libraries})
  target_link_options(ipminmax_mpi PRIVATE LINKER:--no-undefined LINKER:-soname,libipminmax_mpi.so)
  install(TARGETS ipminmax_mpi LIBRARY DESTINATION "${CMAKE_INSTALL_LIBDIR}")

  add_executable(ipminmax-worker "${folder}/worker_main.cpp"
                                 $<TARGET_OBJECTS:ipminmax_mpi_objects>)
  target_compile_definitions(ipminmax-worker PRIVATE IPMINMAX_VERSION="${PROJECT_VERSION}")
  target_include_directories(ipminmax-worker PRIVATE "${PROJECT_SOURCE_DIR}")
  target_link_libraries(ipminmax-worker PRIVATE ipminmax_warnings ${libraries})
  install(TARGETS ipminmax-worker)
  install(FILES "${folder}/ipminmax-worker.1" DESTINATION "${CMAKE_INSTALL_MANDIR}/man1")
endfunction()
