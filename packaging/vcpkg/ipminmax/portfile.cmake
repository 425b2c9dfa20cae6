# An overlay port: vcpkg install ipminmax --overlay-ports=packaging/vcpkg. The source is this checkout; a port of the
# registry has vcpkg_from_git or vcpkg_from_github in its place.
get_filename_component(SOURCE_PATH "${CMAKE_CURRENT_LIST_DIR}/../../.." ABSOLUTE)
string(COMPARE EQUAL "${VCPKG_LIBRARY_LINKAGE}" "dynamic" shared)

vcpkg_find_acquire_program(PKGCONFIG)
vcpkg_cmake_configure(
  SOURCE_PATH "${SOURCE_PATH}"
  OPTIONS
    "-DPKG_CONFIG_EXECUTABLE=${PKGCONFIG}"
    "-DBUILD_SHARED_LIBS=${shared}"
    -DIPMINMAX_BUILD_TESTS=OFF
    -DIPMINMAX_BUILD_EXAMPLES=OFF
    -DIPMINMAX_BUILD_PYTHON=OFF
    -DIPMINMAX_BUILD_CASADI=OFF
    -DIPMINMAX_BUILD_AMPL=OFF
    -DIPMINMAX_MPI=OFF)
vcpkg_cmake_install()
vcpkg_cmake_config_fixup(CONFIG_PATH lib/cmake/ipminmax)
vcpkg_fixup_pkgconfig()
file(REMOVE_RECURSE "${CURRENT_PACKAGES_DIR}/debug/include")
vcpkg_install_copyright(FILE_LIST "${SOURCE_PATH}/LICENSE")
