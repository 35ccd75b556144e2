# Files that `cmake --install` installs, by component: programs and python (their folders say so), data, and library: headers,
# messages, static libraries and the CMake package of common/.
include(CMakePackageConfigHelpers)
set(package lib/cmake/Mimesis)
install(DIRECTORY common DESTINATION include/mimesis COMPONENT library
  FILES_MATCHING PATTERN "*.h" PATTERN test EXCLUDE PATTERN bench EXCLUDE PATTERN fuzz EXCLUDE)
install(DIRECTORY ${CMAKE_BINARY_DIR}/generated/proto DESTINATION include/mimesis COMPONENT library FILES_MATCHING PATTERN "*.pb.h")
install(DIRECTORY proto DESTINATION share/mimesis COMPONENT library FILES_MATCHING PATTERN "*.proto")
install(EXPORT MimesisExport DESTINATION ${package} COMPONENT library)
write_basic_package_version_file(${CMAKE_BINARY_DIR}/MimesisConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES cmake/MimesisConfig.cmake cmake/MimesisFunctions.cmake cmake/param_help.py ${CMAKE_BINARY_DIR}/MimesisConfigVersion.cmake
  DESTINATION ${package} COMPONENT library)

# Programs look for launch files, scenarios of the crowd and models in share/mimesis beside their bin/ (find_project_file).
install(DIRECTORY launch models DESTINATION share/mimesis COMPONENT data)
