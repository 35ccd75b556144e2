# mimesis_scenarios()                                  target scenario-NAME for each launch/NAME.yaml
# mimesis_library(NAME SOURCES ... [LINK ...])         a library of ours, with warnings as errors
# mimesis_program(NAME SOURCES ... [LINK ...])         build/bin/NAME, part of target `programs`
# mimesis_verb(NAME SOURCES ... [LINK ...])            build/bin/mimesis-NAME, the verb `mimesis NAME`: add_NAME of verb.h
# mimesis_test(NAME SOURCES ... [LINK ...] [LABEL unit|node|launch|...] [TIMEOUT s])
# mimesis_benchmark(SUBJECT SOURCES ... [LINK ...])    build/bench/bench_SUBJECT
# mimesis_replay_test(NAME NODE node LOG file [SET KEY=VALUE ...] [TOLERANCE_ELSEWHERE x])
#   The node runs again what a log says, and must do the same (`mimesis log replay`). The tolerance is for machines that
#   compute otherwise than the one that recorded.
# mimesis_node_part(NODE FOLDER [LINK ...] [PRIVATE_LINK ...])
#   A part of a node: FOLDER/*.cc -> library NODE_FOLDER, FOLDER/test/*.cc -> NODE_FOLDER_test. Parts compute; the node
#   around them is in the folder above.
# mimesis_add_node(NAME [BENCH SUBJECT] [ALGO_LINK ...] [NODE_LINK ...])
#   By convention of a node's folder: *_node.cc -> NAME_node, main.cc -> mimesis_NAME, other *.cc -> NAME_algo,
#   test/*_process_test.cc -> NAME_process_test (label node), other test/*.cc -> NAME_test (label unit),
#   bench/*.cc -> bench_SUBJECT (default NAME).

# What runs on a robot or in a demo: everything but tests and benchmarks.
add_custom_target(programs)

# One target a launch file: scenario-NAME builds the programs that launch/NAME.yaml names in `exec:`, the verbs it gives
# `mimesis` to run, and nothing else. Programs that are not built here (DART is absent) are left to the launcher to miss.
function(mimesis_scenarios)
  file(GLOB files CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/launch/*.yaml)
  foreach(file ${files})
    set_property(DIRECTORY ${PROJECT_SOURCE_DIR} APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${file})
    file(READ ${file} text)
    string(REGEX MATCHALL "exec: *mimesis[a-z_]*" programs "${text}")
    string(REGEX MATCHALL "args: *\\[ *[a-z]+" verbs "${text}")
    list(TRANSFORM programs REPLACE "exec: *" "")
    list(TRANSFORM verbs REPLACE "args: *\\[ *" "mimesis-")
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

function(mimesis_library name)
  cmake_parse_arguments(arg "" "" "SOURCES;LINK;PRIVATE_LINK" ${ARGN})
  add_library(${name} STATIC ${arg_SOURCES})
  target_include_directories(${name} PUBLIC ${PROJECT_SOURCE_DIR})
  target_link_libraries(${name} PUBLIC ${arg_LINK} PRIVATE mimesis_warnings ${arg_PRIVATE_LINK})
endfunction()

function(mimesis_executable name)
  cmake_parse_arguments(arg "" "" "SOURCES;LINK" ${ARGN})
  add_executable(${name} ${arg_SOURCES})
  target_include_directories(${name} PRIVATE ${PROJECT_SOURCE_DIR})
  target_link_libraries(${name} PRIVATE mimesis_warnings ${arg_LINK})
endfunction()

# A program of build/bin.
function(mimesis_program name)
  mimesis_executable(${name} ${ARGN})
  add_dependencies(programs ${name})
  install(TARGETS ${name} RUNTIME DESTINATION bin COMPONENT programs)
endfunction()

# A verb of `mimesis`: the program mimesis-NAME, run by the dispatcher that stands beside it.
function(mimesis_verb name)
  cmake_parse_arguments(arg "" "" "SOURCES;LINK" ${ARGN})
  string(REPLACE "-" "_" add ${name})
  set(main ${CMAKE_CURRENT_BINARY_DIR}/${add}_main.cc)
  file(CONFIGURE OUTPUT ${main} CONTENT [[
#include "tools/mimesis/verb.h"

int main(int argc, char** argv) {
  return mimesis::tool::run_verb("@name@", argc, argv, mimesis::tool::add_@add@);
}
]] @ONLY)
  mimesis_program(mimesis-${name} SOURCES ${main} ${arg_SOURCES} LINK mimesis_tool ${arg_LINK})
endfunction()

function(mimesis_test name)
  cmake_parse_arguments(arg "" "LABEL;TIMEOUT" "SOURCES;LINK" ${ARGN})
  if(NOT arg_LABEL)
    set(arg_LABEL unit)
  endif()
  if(NOT arg_TIMEOUT)
    set(arg_TIMEOUT 120)
  endif()
  mimesis_executable(${name} SOURCES ${arg_SOURCES} LINK ${arg_LINK} GTest::gtest_main)
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/test)
  target_compile_definitions(${name} PRIVATE
    MIMESIS_SOURCE_DIR="${PROJECT_SOURCE_DIR}" MIMESIS_BIN_DIR="${CMAKE_BINARY_DIR}/bin")
  add_test(NAME ${name} COMMAND ${name})
  set_tests_properties(${name} PROPERTIES LABELS ${arg_LABEL} TIMEOUT ${arg_TIMEOUT} SKIP_RETURN_CODE 77)
endfunction()

function(mimesis_replay_test name)
  cmake_parse_arguments(arg "" "NODE;LOG;TOLERANCE_ELSEWHERE" "SET" ${ARGN})
  get_filename_component(log ${arg_LOG} ABSOLUTE)
  set(command $<TARGET_FILE:mimesis-log> replay ${arg_NODE} ${log})
  foreach(set ${arg_SET})
    list(APPEND command --set ${set})
  endforeach()
  if(arg_TOLERANCE_ELSEWHERE)
    list(APPEND command --tolerance-elsewhere ${arg_TOLERANCE_ELSEWHERE})
  endif()
  add_test(NAME ${name} COMMAND ${command})
  set_tests_properties(${name} PROPERTIES LABELS node TIMEOUT 120)
endfunction()

function(mimesis_benchmark subject)
  cmake_parse_arguments(arg "" "" "SOURCES;LINK" ${ARGN})
  mimesis_executable(bench_${subject} SOURCES ${arg_SOURCES} LINK ${arg_LINK} benchmark::benchmark_main)
  set_target_properties(bench_${subject} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/bench)
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

function(mimesis_add_node name)
  cmake_parse_arguments(arg "" "BENCH" "ALGO_LINK;NODE_LINK" ${ARGN})
  if(NOT arg_BENCH)
    set(arg_BENCH ${name})
  endif()
  file(GLOB sources CONFIGURE_DEPENDS *.cc)
  file(GLOB node_sources CONFIGURE_DEPENDS *_node.cc)
  file(GLOB tests CONFIGURE_DEPENDS test/*.cc)
  file(GLOB process_tests CONFIGURE_DEPENDS test/*_process_test.cc)
  file(GLOB benches CONFIGURE_DEPENDS bench/*.cc)
  list(REMOVE_ITEM sources ${CMAKE_CURRENT_SOURCE_DIR}/main.cc ${node_sources})
  if(process_tests)
    list(REMOVE_ITEM tests ${process_tests})
  endif()

  if(sources)
    mimesis_library(${name}_algo SOURCES ${sources} LINK Eigen3::Eigen mimesis_error ${arg_ALGO_LINK})
    set(algo ${name}_algo)
  endif()
  mimesis_library(${name}_node SOURCES ${node_sources} LINK ${algo} mimesis_runtime ${arg_NODE_LINK})
  mimesis_program(mimesis_${name} SOURCES main.cc LINK ${name}_node)
  if(tests)
    mimesis_test(${name}_test SOURCES ${tests} LINK ${name}_node mimesis_testing)
  endif()
  if(process_tests)
    mimesis_test(${name}_process_test SOURCES ${process_tests} LINK ${name}_node mimesis_testing LABEL node)
    add_dependencies(${name}_process_test mimesis_${name})
  endif()
  if(benches)
    mimesis_benchmark(${arg_BENCH} SOURCES ${benches} LINK ${name}_node)
  endif()
endfunction()
