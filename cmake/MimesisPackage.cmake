# Debian packages: `cpack -G DEB` in the build directory writes mimesis (programs, models, launch files, service),
# libmimesis-dev and python3-mimesis. Of a build with the default prefix; paths are those of /usr.
if(NOT TARGET mimesis-view OR NOT TARGET page)
  message(STATUS "no packages: they hold mimesis view and its page, which need Boost and npm (tools/setup package)")
  return()
endif()
set(package ${CMAKE_CURRENT_LIST_DIR}/package)

# Pages of `mimesis`, its verbs and nodes, from their --help.
find_program(MIMESIS_HELP2MAN help2man)
if(MIMESIS_HELP2MAN)
  install(CODE "
    file(GLOB programs ${CMAKE_BINARY_DIR}/bin/mimesis*)
    set(man \$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/share/man/man1)
    file(MAKE_DIRECTORY \${man})
    foreach(program \${programs})
      get_filename_component(name \${program} NAME)
      execute_process(COMMAND \${program} --help OUTPUT_VARIABLE help COMMAND_ERROR_IS_FATAL ANY)
      string(REGEX MATCH \"^[^\\n]*\" what \"\${help}\")
      execute_process(COMMAND ${MIMESIS_HELP2MAN} --no-info --version-string=${PROJECT_VERSION} \"--name=\${what}\"
        --output=\${man}/\${name}.1 \${program} COMMAND_ERROR_IS_FATAL ANY)
      execute_process(COMMAND gzip -9nf \${man}/\${name}.1 COMMAND_ERROR_IS_FATAL ANY)
    endforeach()" COMPONENT man EXCLUDE_FROM_ALL)
endif()

function(mimesis_package_file file destination)
  install(FILES ${package}/${file} DESTINATION ${destination} COMPONENT system EXCLUDE_FROM_ALL ${ARGN})
endfunction()
mimesis_package_file(mimesis@.service lib/systemd/system)
mimesis_package_file(70-mimesis.rules lib/udev/rules.d)
mimesis_package_file(sysusers.conf lib/sysusers.d RENAME mimesis.conf)
mimesis_package_file(README /etc/mimesis)
mimesis_package_file(limits.conf /etc/security/limits.d RENAME mimesis.conf)
mimesis_package_file(overrides share/lintian/overrides RENAME mimesis)

set(MIMESIS_MAINTAINER "Mimesis <maintainers@example.org>" CACHE STRING "Maintainer of the Debian packages")

# Each package has a copyright and a changelog.
set(changelog ${CMAKE_BINARY_DIR}/changelog)
string(TIMESTAMP date "%a, %d %b %Y %H:%M:%S +0000" UTC)
file(WRITE ${changelog} "mimesis (${PROJECT_VERSION}) unstable; urgency=medium\n\n"
  "  * See /usr/share/doc/mimesis/CHANGELOG.md.\n\n -- ${MIMESIS_MAINTAINER}  ${date}\n")
execute_process(COMMAND gzip -9nf ${changelog})
foreach(pair system:mimesis library:libmimesis-dev python:python3-mimesis)
  string(REPLACE ":" ";" pair ${pair})
  list(GET pair 0 component)
  list(GET pair 1 name)
  install(FILES ${package}/copyright ${changelog}.gz DESTINATION share/doc/${name} COMPONENT ${component} EXCLUDE_FROM_ALL)
endforeach()
install(FILES CHANGELOG.md DESTINATION share/doc/mimesis COMPONENT system EXCLUDE_FROM_ALL)

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_VENDOR Mimesis)
set(CPACK_PACKAGE_CONTACT ${MIMESIS_MAINTAINER})
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_SET_DESTDIR ON)  # for /etc
set(CPACK_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_COMPONENTS_ALL programs data system python library)
if(MIMESIS_HELP2MAN)
  list(APPEND CPACK_COMPONENTS_ALL man)
endif()

set(CPACK_DEBIAN_RUNTIME_PACKAGE_NAME mimesis)
set(CPACK_DEBIAN_RUNTIME_PACKAGE_SECTION science)
set(CPACK_DEBIAN_RUNTIME_PACKAGE_RECOMMENDS "systemd, iproute2, gnuplot-nox")
set(CPACK_DEBIAN_RUNTIME_PACKAGE_CONTROL_EXTRA ${package}/postinst ${package}/conffiles)
set(CPACK_DEBIAN_RUNTIME_DESCRIPTION "nodes of robots that imitate, walk and cooperate
A graph of processes that exchange Protobuf messages over ZeroMQ: vision,
cognition, planner, motion, walking, crowds and hardware over CAN and Modbus,
with simulated drives and physics behind the same buses; tools to launch,
record, replay and look at it.")
set(CPACK_DEBIAN_DEV_PACKAGE_NAME libmimesis-dev)
set(CPACK_DEBIAN_DEV_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEV_PACKAGE_DEPENDS
  "mimesis, cmake, g++, pkg-config, protobuf-compiler, libprotobuf-dev, libzmq3-dev, libeigen3-dev, libspdlog-dev, libfmt-dev, libyaml-cpp-dev, libexpected-dev")
set(CPACK_DEBIAN_DEV_PACKAGE_RECOMMENDS "libgtest-dev, liblz4-dev, libzstd-dev, zlib1g-dev, libdeflate-dev")  # tests, component log
set(CPACK_DEBIAN_DEV_PACKAGE_SUGGESTS "libpng-dev, libturbojpeg0-dev, libjpeg-dev, liburdfdom-dev, libassimp-dev, libqhull-dev")  # image, robot, cover
set(CPACK_DEBIAN_DEV_DESCRIPTION "libraries, messages and CMake functions for nodes of Mimesis
What a node outside of Mimesis needs: find_package(Mimesis), headers and static
libraries of the runtime, messages.")
set(CPACK_DEBIAN_PYTHON_PACKAGE_NAME python3-mimesis)
set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
set(CPACK_DEBIAN_PYTHON_PACKAGE_ARCHITECTURE all)
set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS "python3, python3-zmq, python3-protobuf")
set(CPACK_DEBIAN_PYTHON_PACKAGE_RECOMMENDS "python3-yaml")  # parameters of launch files
set(CPACK_DEBIAN_PYTHON_DESCRIPTION "topics, services and logs of Mimesis in Python
Publishes, subscribes, calls services and reads message logs of a graph of
Mimesis.")
include(CPack)
foreach(component programs data system man)
  cpack_add_component(${component} GROUP runtime)
endforeach()
cpack_add_component(library GROUP dev)
cpack_add_component(python GROUP python)
