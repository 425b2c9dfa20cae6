# ipminmax.pc. Static libraries name what they link in Libs, shared ones in Libs.private.
set(pc_dependencies "")
foreach(library ${MUMPS_DMUMPS_LIBRARY} ${METIS_LIBRARY} ${LAPACK_LIBRARIES}
                ${CMAKE_THREAD_LIBS_INIT} -lstdc++ -lm)
  if(IS_ABSOLUTE "${library}")  # /path/libname.so -> -L/path -lname
    get_filename_component(directory "${library}" DIRECTORY)
    get_filename_component(name "${library}" NAME_WE)
    string(REGEX REPLACE "^lib" "" name "${name}")
    set(library "-L${directory} -l${name}")
  endif()
  string(APPEND pc_dependencies " ${library}")
endforeach()
if(BUILD_SHARED_LIBS)
  set(pc_public "")
  set(pc_private "${pc_dependencies}")
else()
  set(pc_public "${pc_dependencies}")
  set(pc_private "")
endif()
if(IS_ABSOLUTE "${CMAKE_INSTALL_LIBDIR}")
  set(pc_prefix "${CMAKE_INSTALL_PREFIX}")
else()  # relative to the file itself, so that an installed prefix can be moved
  file(RELATIVE_PATH up "/${CMAKE_INSTALL_LIBDIR}/pkgconfig" "/")
  string(REGEX REPLACE "/$" "" up "${up}")
  set(pc_prefix "\${pcfiledir}/${up}")
endif()
cmake_path(APPEND pc_libdir "\${prefix}" "${CMAKE_INSTALL_LIBDIR}")  # an absolute path replaces
cmake_path(APPEND pc_includedir "\${prefix}" "${CMAKE_INSTALL_INCLUDEDIR}")
configure_file(cmake/ipminmax.pc.in ipminmax.pc @ONLY)
install(FILES "${CMAKE_CURRENT_BINARY_DIR}/ipminmax.pc"
        DESTINATION "${CMAKE_INSTALL_LIBDIR}/pkgconfig")
