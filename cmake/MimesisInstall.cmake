# Files that `cmake --install` installs, by component: programs and python (their folders say so), data, and library: headers,
# messages, static libraries and the CMake package of common/.
include(CMakePackageConfigHelpers)
set(package lib/cmake/Mimesis)
install(DIRECTORY common DESTINATION include/mimesis COMPONENT library
  FILES_MATCHING PATTERN "*.h" PATTERN test EXCLUDE PATTERN bench EXCLUDE PATTERN fuzz EXCLUDE)
install(DIRECTORY ${CMAKE_BINARY_DIR}/generated/proto DESTINATION include/mimesis COMPONENT library FILES_MATCHING PATTERN "*.pb.h")
install(DIRECTORY proto DESTINATION share/mimesis COMPONENT library FILES_MATCHING PATTERN "*.proto")

# Components of find_package(Mimesis), each a library Mimesis::NAME with a file of its own, so that one that was not asked for needs no
# package. MimesisComponents.cmake says what each needs: components, packages, and modules of pkg-config as NAME=MODULE.
set(components "")
foreach(target mimesis_convex mimesis_cover mimesis_error mimesis_image mimesis_kin mimesis_log mimesis_math mimesis_model mimesis_parallel
    mimesis_params mimesis_plot mimesis_proto mimesis_qp mimesis_rig_file mimesis_robot mimesis_runtime mimesis_shared_data mimesis_task
    mimesis_testing motion_capture motion_demix motion_mixture motion_model motion_retarget motion_skeleton)
  string(REGEX REPLACE "^mimesis_" "" name ${target})
  string(REGEX REPLACE "^runtime$" "node" name ${name})  # common/runtime is all that a node needs
  list(APPEND components ${name})
  add_library(Mimesis::${name} ALIAS ${target})
  target_include_directories(${target} INTERFACE $<INSTALL_INTERFACE:include/mimesis>)
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${name})
  install(TARGETS ${target} EXPORT Mimesis_${name} ARCHIVE DESTINATION lib COMPONENT library)
  install(EXPORT Mimesis_${name} NAMESPACE Mimesis:: DESTINATION ${package} COMPONENT library)
  set(needs "")
  get_target_property(links ${target} INTERFACE_LINK_LIBRARIES)
  foreach(link ${links})
    string(REGEX REPLACE "^[$]<LINK_ONLY:(.*)>$" "\\1" link ${link})
    if(link MATCHES "^PkgConfig::(.*)")
      list(APPEND needs ${CMAKE_MATCH_1}=${${CMAKE_MATCH_1}_MODULE_NAME})
    elseif(link MATCHES "^(mimesis|motion)_|^[A-Za-z0-9_:-]+$")
      list(APPEND needs ${link})
    elseif(link AND NOT link MATCHES "BUILD_INTERFACE")
      message(FATAL_ERROR "${target}: what does a user of ${link} have to find?")
    endif()
  endforeach()
  string(REGEX REPLACE "mimesis_runtime" "node" needs "${needs}")
  string(REGEX REPLACE "mimesis_" "" needs "${needs}")
  string(REGEX REPLACE "::[A-Za-z_]+" "" needs "${needs}")
  string(REPLACE "protobuf" "Protobuf" needs "${needs}")
  string(APPEND table "set(mimesis_needs_${name} ${needs})\n")
endforeach()
file(CONFIGURE OUTPUT ${CMAKE_BINARY_DIR}/MimesisComponents.cmake CONTENT "set(mimesis_components @components@)\n@table@" @ONLY)
write_basic_package_version_file(${CMAKE_BINARY_DIR}/MimesisConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES cmake/MimesisConfig.cmake cmake/MimesisFunctions.cmake cmake/param_help.py ${CMAKE_BINARY_DIR}/MimesisComponents.cmake
  ${CMAKE_BINARY_DIR}/MimesisConfigVersion.cmake DESTINATION ${package} COMPONENT library)

# Programs look for launch files, scenarios of the crowd and models in share/mimesis beside their bin/ (find_project_file).
install(DIRECTORY launch models DESTINATION share/mimesis COMPONENT data)
