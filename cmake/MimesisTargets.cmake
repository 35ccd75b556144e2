# Functions of this tree alone; those for any node are in MimesisFunctions.cmake.
# mimesis_scenarios()                                  target scenario-NAME for each launch/NAME.yaml
# mimesis_verb(NAME SOURCES ... [LINK ...])            build/bin/mimesis-NAME, the verb `mimesis NAME`: add_NAME of verb.h
# mimesis_verb(VERB-SUB OF VERB SOURCES ... [LINK ...])  build/bin/mimesis-VERB-SUB: an add_VERB with `mimesis VERB SUB` alone
# mimesis_node_part(NODE FOLDER [LINK ...] [PRIVATE_LINK ...])
#   A part of a node: FOLDER/*.cc -> library NODE_FOLDER, FOLDER/test/*.cc -> NODE_FOLDER_test. Parts compute; the node
#   around them is in the folder above.
include(MimesisFunctions)
set(MIMESIS_TREE TRUE)  # functions are called here, not by a project that found the package
add_custom_target(programs)  # for a robot or a demo: everything but tests and benchmarks
add_custom_target(tests)     # all that ctest runs
add_dependencies(tests programs)

# Most of the cost of a file is its headers, so those of the standard library and of the packages used most are parsed
# once for all libraries and programs, once for all tests and once for verbs, which add theirs. Tests and verbs are
# optimised little, but for inlining, without which the mathematics in headers takes twice as long: a third less time to
# compile. Each source still includes what it uses: clang-tidy (tools/test --lint)
# and -DCMAKE_DISABLE_PRECOMPILE_HEADERS=ON compile without them.
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  file(CONFIGURE OUTPUT ${CMAKE_BINARY_DIR}/mimesis_headers.cc CONTENT "")
  set(headers
    <Eigen/Dense> <algorithm> <array> <chrono> <cmath> <filesystem> <fstream> <functional> <map> <memory> <mutex> <numeric>
    <optional> <random> <set> <span> <string> <thread> <unordered_map> <variant> <vector>
    <google/protobuf/descriptor.h> <google/protobuf/generated_message_reflection.h>
    <google/protobuf/map.h> <google/protobuf/message.h> <google/protobuf/repeated_field.h>)
  foreach(name mimesis_headers mimesis_test_headers mimesis_verb_headers)
    add_library(${name} OBJECT ${CMAKE_BINARY_DIR}/mimesis_headers.cc)
    target_link_libraries(${name} PRIVATE mimesis_warnings Eigen3::Eigen protobuf::libprotobuf Threads::Threads)
    target_precompile_headers(${name} PRIVATE ${headers})
  endforeach()
  target_link_libraries(mimesis_test_headers PRIVATE GTest::gtest)
  target_precompile_headers(mimesis_test_headers PRIVATE <gtest/gtest.h>)
  target_precompile_headers(mimesis_verb_headers PRIVATE <CLI/CLI.hpp> <nlohmann/json.hpp>)
  foreach(name mimesis_test_headers mimesis_verb_headers)
    target_compile_options(${name} PRIVATE $<$<CONFIG:Release>:-O1>
      "$<$<CONFIG:Release>:SHELL:-finline-small-functions -findirect-inlining -fpartial-inlining -finline-functions>"
      # So g++ 12 suspects its own strings and Eigen's vectors.
      "$<$<CONFIG:Release>:SHELL:-Wno-array-bounds -Wno-stringop-overflow -Wno-restrict>")
  endforeach()
endif()

# One target a launch file: scenario-NAME builds the programs that launch/NAME.yaml and what it includes name in `exec:`, the verbs in the
# `args:` right after `exec: mimesis`, and nothing else (a node that the demo does not start has its `if:` between the two).
# Programs that are not built here (DART is absent) are left to the launcher to miss.
function(mimesis_scenarios)
  file(GLOB files CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/launch/*.yaml)
  foreach(file ${files})
    set_property(DIRECTORY ${PROJECT_SOURCE_DIR} APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${file})
    file(READ ${file} text)
    string(REGEX MATCHALL "file: *[a-z_/]+[.]yaml" included "${text}")
    foreach(part ${included})
      string(REGEX REPLACE "file: *" "${PROJECT_SOURCE_DIR}/launch/" part ${part})
      set_property(DIRECTORY ${PROJECT_SOURCE_DIR} APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${part})
      file(READ ${part} more)
      string(APPEND text "${more}")
    endforeach()
    string(REGEX REPLACE "#[^\n]*" "" text "${text}")
    string(REGEX MATCHALL "exec: *mimesis[a-z_]*" programs "${text}")
    string(REGEX MATCHALL "exec: *mimesis[ \n]+args:[ \n]*\\[ *[a-z]+(, *[a-z]+)?" verbs "${text}")
    list(TRANSFORM programs REPLACE "exec: *" "")
    list(TRANSFORM verbs REPLACE "^.*args:[ \n]*\\[ *" "mimesis-")
    list(TRANSFORM verbs REPLACE ", *" "-")
    foreach(verb ${verbs})
      if(NOT TARGET ${verb})
        string(REGEX REPLACE "(mimesis-[a-z]+)-.*" "\\1" alone ${verb})
        list(TRANSFORM verbs REPLACE "^${verb}$" ${alone})
      endif()
    endforeach()
    set(needed mimesis mimesis-launch mimesis_clock ${programs} ${verbs})
    list(REMOVE_DUPLICATES needed)
    get_filename_component(name ${file} NAME_WE)
    add_custom_target(scenario-${name})
    foreach(program ${needed})
      if(TARGET ${program})
        add_dependencies(scenario-${name} ${program})
      endif()
    endforeach()
  endforeach()
endfunction()

# A verb of `mimesis`: the program mimesis-NAME, run by the dispatcher that stands beside it.
function(mimesis_verb name)
  cmake_parse_arguments(arg "" "OF" "SOURCES;LINK" ${ARGN})
  string(REPLACE "-" "_" file ${name})
  set(main ${CMAKE_CURRENT_BINARY_DIR}/${file}_main.cc)
  set(verb ${name})
  if(arg_OF)
    set(verb ${arg_OF})
  endif()
  string(REPLACE "-" "_" add ${verb})
  file(CONFIGURE OUTPUT ${main} CONTENT [[
#include "tools/mimesis/verb.h"

int main(int argc, char** argv) {
  return mimesis::tool::run_verb("@verb@", argc, argv, mimesis::tool::add_@add@);
}
]] @ONLY)
  mimesis_program(mimesis-${name} HEADERS mimesis_verb_headers SOURCES ${main} ${arg_SOURCES} LINK mimesis_tool ${arg_LINK})
endfunction()

function(mimesis_node_part node folder)
  cmake_parse_arguments(arg "" "" "LINK;PRIVATE_LINK" ${ARGN})
  set(name ${node}_${folder})
  file(GLOB sources CONFIGURE_DEPENDS ${folder}/*.cc)
  file(GLOB tests CONFIGURE_DEPENDS ${folder}/test/*.cc)
  if(sources)
    mimesis_library(${name} SOURCES ${sources}
      LINK mimesis_math mimesis_error ${arg_LINK} PRIVATE_LINK ${arg_PRIVATE_LINK})
  else()
    add_library(${name} INTERFACE)
    target_link_libraries(${name} INTERFACE mimesis_math mimesis_error ${arg_LINK})
  endif()
  if(tests)
    mimesis_test(${name}_test SOURCES ${tests} LINK ${name} mimesis_testing)
  endif()
endfunction()
