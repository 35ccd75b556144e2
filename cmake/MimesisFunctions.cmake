# Functions for nodes, in this tree and outside of it (find_package(Mimesis) brings this file):
# mimesis_add_node(NAME [BENCH SUBJECT] [SHELL STEM ...] [ALGO_LINK ...] [NODE_LINK ...])
#   By convention of a node's folder: *_node.cc, *_messages.cc, *_drawing.cc, *_params.cc and STEM.cc -> NAME_node,
#   main.cc -> mimesis_NAME, other *.cc -> NAME_algo, test/*_process_test.cc -> NAME_process_test (label node), other
#   test/*.cc -> NAME_test (label unit), bench/*.cc -> bench_SUBJECT (default NAME). In a folder without main.cc, NAME.cc is
#   the whole node.
# mimesis_add_messages(NAME PROTO ...)                 library NAME of the messages in the .proto files, whose paths are
#   relative to PROJECT_SOURCE_DIR and are those of the headers: msg/a.proto -> "msg/a.pb.h"; they may import "proto/*.proto"
# mimesis_library(NAME SOURCES ... [LINK ...])         a library with this project's warnings
# mimesis_program(NAME SOURCES ... [LINK ...])         build/bin/NAME, part of target `programs`; its main is in the first of
#   the SOURCES
# mimesis_test(NAME SOURCES ... [LINK ...] [LABEL unit|node|launch|...] [TIMEOUT s])   s: on a quiet machine, at most
# mimesis_replay_test(NAME NODE node LOG file [SET KEY=VALUE ...] [TOLERANCE_ELSEWHERE x])
#   The node repeats the steps of a log, and must do the same (`mimesis log replay`). The tolerance is for machines that
#   compute otherwise than the one that recorded.
# mimesis_benchmark(SUBJECT SOURCES ... [LINK ...])    build/bench/bench_SUBJECT
cmake_policy(VERSION 3.25)  # of the functions, whatever the project that calls them asks for

# How libraries and programs are compiled. In this tree (MimesisTargets.cmake): its precompiled headers and the options they
# were compiled with, since the compiler keeps to those; a target with other options sets DISABLE_PRECOMPILE_HEADERS.
function(mimesis_compile name headers)
  target_compile_features(${name} PUBLIC cxx_std_20)
  if(TARGET ${headers})
    get_target_property(options ${headers} COMPILE_OPTIONS)
    if(options)
      target_compile_options(${name} PRIVATE ${options})
    endif()
    target_precompile_headers(${name} REUSE_FROM ${headers})
  elseif(NOT MIMESIS_TREE)
    target_compile_options(${name} PRIVATE -ffp-contract=off)  # same inputs, same bits: replay depends on it
  endif()
endfunction()

# A package that only some nodes need is sought where the first of them is made.
macro(mimesis_need target)
  if(NOT TARGET ${target})
    find_package(${ARGN} REQUIRED)
  endif()
endmacro()

function(mimesis_library name)
  cmake_parse_arguments(arg "" "HEADERS" "SOURCES;LINK;PRIVATE_LINK" ${ARGN})
  if(NOT arg_HEADERS)
    set(arg_HEADERS mimesis_headers)
  endif()
  add_library(${name} STATIC ${arg_SOURCES})
  target_include_directories(${name} PUBLIC $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}>)
  target_link_libraries(${name} PUBLIC ${arg_LINK}
    PRIVATE $<BUILD_INTERFACE:$<TARGET_NAME_IF_EXISTS:mimesis_warnings>> ${arg_PRIVATE_LINK})
  mimesis_compile(${name} ${arg_HEADERS})
endfunction()

function(mimesis_executable name)
  cmake_parse_arguments(arg "" "HEADERS" "SOURCES;LINK" ${ARGN})
  if(NOT arg_HEADERS)
    set(arg_HEADERS mimesis_headers)
  endif()
  add_executable(${name} ${arg_SOURCES})
  target_include_directories(${name} PRIVATE ${PROJECT_SOURCE_DIR})
  target_link_libraries(${name} PRIVATE $<TARGET_NAME_IF_EXISTS:mimesis_warnings> ${arg_LINK})
  mimesis_compile(${name} ${arg_HEADERS})
endfunction()

# A program for libFuzzer, with those of preset `fuzz` alone. Target `fuzzers` builds all.
function(mimesis_fuzzer name)
  if(NOT MIMESIS_FUZZ)
    return()
  endif()
  mimesis_executable(${name} ${ARGN})
  target_link_options(${name} PRIVATE -fsanitize=fuzzer)
  if(NOT TARGET fuzzers)
    add_custom_target(fuzzers)
  endif()
  add_dependencies(fuzzers ${name})
endfunction()

# The words of --help and --describe for a node's parameters: comments at their declarations in `main` and what it includes.
find_program(MIMESIS_PYTHON NAMES python3 PATHS /usr/bin NO_DEFAULT_PATH)
function(mimesis_explain name main)
  set(script ${CMAKE_CURRENT_FUNCTION_LIST_DIR}/param_help.py)
  set(output ${CMAKE_CURRENT_BINARY_DIR}/generated/${name}_help.cc)  # not beside sources, if they are built in their own folder
  add_custom_command(OUTPUT ${output}
    COMMAND ${MIMESIS_PYTHON} ${script} ${output} ${CMAKE_CURRENT_SOURCE_DIR}/${main} ${PROJECT_SOURCE_DIR}
    DEPENDS ${script} ${main} DEPFILE ${output}.d VERBATIM)
  set_source_files_properties(${output} PROPERTIES SKIP_PRECOMPILE_HEADERS ON)
  target_sources(${name} PRIVATE ${output})
endfunction()

function(mimesis_program name)
  mimesis_executable(${name} ${ARGN})
  if(NOT CMAKE_RUNTIME_OUTPUT_DIRECTORY)  # together, so that launch files find them by one PATH
    set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/bin)
  endif()
  cmake_parse_arguments(arg "" "" "SOURCES" ${ARGN})
  list(GET arg_SOURCES 0 main)
  if(MIMESIS_PYTHON AND name MATCHES "^mimesis_")
    mimesis_explain(${name} ${main})
  endif()
  if(MIMESIS_TREE)
    add_dependencies(programs ${name})
  endif()
  install(TARGETS ${name} RUNTIME DESTINATION bin COMPONENT programs)
endfunction()

function(mimesis_test name)
  cmake_parse_arguments(arg "" "LABEL;TIMEOUT" "SOURCES;LINK" ${ARGN})
  if(NOT arg_LABEL)
    set(arg_LABEL unit)
  endif()
  if(NOT arg_TIMEOUT)
    set(arg_TIMEOUT 120)
  endif()
  mimesis_need(GTest::gtest_main GTest)
  mimesis_executable(${name} SOURCES ${arg_SOURCES} LINK ${arg_LINK} GTest::gtest_main HEADERS mimesis_test_headers)
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/test)
  target_compile_definitions(${name} PRIVATE
    MIMESIS_SOURCE_DIR="${PROJECT_SOURCE_DIR}" MIMESIS_BIN_DIR="${CMAKE_BINARY_DIR}/bin")
  if(MIMESIS_TREE)
    add_dependencies(tests ${name})
  endif()
  add_test(NAME ${name} COMMAND ${name})
  math(EXPR limit "10 * ${arg_TIMEOUT}")  # TIMEOUT is that of a quiet machine
  set_tests_properties(${name} PROPERTIES LABELS ${arg_LABEL} TIMEOUT ${limit} SKIP_RETURN_CODE 77)
  if(arg_LABEL STREQUAL launch)
    set_tests_properties(${name} PROPERTIES COST 50)  # long ones first
  endif()
endfunction()

function(mimesis_benchmark subject)
  cmake_parse_arguments(arg "" "" "SOURCES;LINK" ${ARGN})
  mimesis_need(benchmark::benchmark_main benchmark)
  mimesis_executable(bench_${subject} SOURCES ${arg_SOURCES} LINK ${arg_LINK} benchmark::benchmark_main)
  set_target_properties(bench_${subject} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/bench)
endfunction()

function(mimesis_replay_test name)
  cmake_parse_arguments(arg "" "NODE;LOG;TOLERANCE_ELSEWHERE" "SET" ${ARGN})
  get_filename_component(log ${arg_LOG} ABSOLUTE)
  if(MIMESIS_TREE)
    set(command $<TARGET_FILE:mimesis-log> replay)
  else()
    set(command ${CMAKE_CURRENT_FUNCTION_LIST_DIR}/../../../bin/mimesis log replay --exec $<TARGET_FILE:mimesis_${arg_NODE}>)
  endif()
  list(APPEND command ${arg_NODE} ${log})
  foreach(set ${arg_SET})
    list(APPEND command --set ${set})
  endforeach()
  if(arg_TOLERANCE_ELSEWHERE)
    list(APPEND command --tolerance-elsewhere ${arg_TOLERANCE_ELSEWHERE})
  endif()
  add_test(NAME ${name} COMMAND ${command})
  set_tests_properties(${name} PROPERTIES LABELS node TIMEOUT 1200)
endfunction()

function(mimesis_add_node name)
  cmake_parse_arguments(arg "" "BENCH" "SHELL;ALGO_LINK;NODE_LINK" ${ARGN})
  if(NOT arg_BENCH)
    set(arg_BENCH ${name})
  endif()
  if(NOT EXISTS ${CMAKE_CURRENT_SOURCE_DIR}/main.cc)
    mimesis_program(mimesis_${name} SOURCES ${name}.cc LINK Mimesis::node ${arg_NODE_LINK})
    return()
  endif()
  file(GLOB sources CONFIGURE_DEPENDS *.cc)
  file(GLOB node_sources CONFIGURE_DEPENDS *_node.cc *_messages.cc *_drawing.cc *_params.cc)
  foreach(stem ${arg_SHELL})
    list(APPEND node_sources ${CMAKE_CURRENT_SOURCE_DIR}/${stem}.cc)
  endforeach()
  file(GLOB tests CONFIGURE_DEPENDS test/*.cc)
  file(GLOB process_tests CONFIGURE_DEPENDS test/*_process_test.cc)
  file(GLOB benches CONFIGURE_DEPENDS bench/*.cc)
  list(REMOVE_ITEM sources ${CMAKE_CURRENT_SOURCE_DIR}/main.cc ${node_sources})
  if(process_tests)
    list(REMOVE_ITEM tests ${process_tests})
  endif()

  if(sources)
    mimesis_need(Eigen3::Eigen Eigen3 3.4 NO_MODULE)
    mimesis_library(${name}_algo SOURCES ${sources} LINK Eigen3::Eigen Mimesis::error ${arg_ALGO_LINK})
    set(algo ${name}_algo)
  endif()
  mimesis_library(${name}_node SOURCES ${node_sources} LINK ${algo} Mimesis::node ${arg_NODE_LINK})
  mimesis_program(mimesis_${name} SOURCES main.cc LINK ${name}_node)
  if(tests OR process_tests)
    mimesis_need(Mimesis::testing Mimesis COMPONENTS testing)
  endif()
  if(tests)
    mimesis_test(${name}_test SOURCES ${tests} LINK ${name}_node Mimesis::testing)
  endif()
  if(process_tests)
    mimesis_test(${name}_process_test SOURCES ${process_tests} LINK ${name}_node Mimesis::testing LABEL node)
    add_dependencies(${name}_process_test mimesis_${name})
  endif()
  if(benches)
    mimesis_benchmark(${arg_BENCH} SOURCES ${benches} LINK ${name}_node)
  endif()
endfunction()

function(mimesis_add_messages name)
  set(generated ${PROJECT_BINARY_DIR}/generated)
  set(proto_path ${PROJECT_SOURCE_DIR})
  if(NOT MIMESIS_TREE)
    list(APPEND proto_path ${CMAKE_CURRENT_FUNCTION_LIST_DIR}/../../../share/mimesis)
  endif()
  list(TRANSFORM proto_path PREPEND --proto_path=)
  set(files)
  foreach(batch 0 1)
    set(includes_${batch})
    set(bodies_${batch})
  endforeach()
  set(batch 0)
  foreach(proto ${ARGN})
    string(REGEX REPLACE "\\.proto$" ".pb" stem ${proto})
    add_custom_command(
      OUTPUT ${generated}/${stem}.cc ${generated}/${stem}.h
      COMMAND protobuf::protoc ${proto_path} --cpp_out=${generated} ${proto}
      DEPENDS ${PROJECT_SOURCE_DIR}/${proto}
      WORKING_DIRECTORY ${PROJECT_SOURCE_DIR}
      VERBATIM)
    list(APPEND files ${generated}/${stem}.cc ${generated}/${stem}.h)
    string(MAKE_C_IDENTIFIER ${stem} id)
    string(APPEND includes_${batch} "#include \"${stem}.h\"\n")
    # Two tables have the same name in every generated file.
    string(APPEND bodies_${batch} "
#define schemas schemas_${id}
#define file_default_instances file_default_instances_${id}
#include \"${stem}.cc\"
#undef schemas
#undef file_default_instances
")
    math(EXPR batch "1 - ${batch}")
  endforeach()
  # Two batches: most of the cost of generated code is protobuf's own headers.
  set(sources)
  foreach(batch 0 1)
    if(bodies_${batch})
      set(source ${generated}/${name}_${batch}.cc)
      file(CONFIGURE OUTPUT ${source} CONTENT "@includes_${batch}@@bodies_${batch}@" @ONLY)
      list(APPEND sources ${source})
    endif()
  endforeach()
  set_source_files_properties(${files} PROPERTIES HEADER_FILE_ONLY ON)
  add_library(${name} STATIC ${sources} ${files})
  set_target_properties(${name} PROPERTIES UNITY_BUILD OFF)
  target_include_directories(${name} SYSTEM PUBLIC $<BUILD_INTERFACE:${generated}>)
  target_link_libraries(${name} PUBLIC protobuf::libprotobuf)
  if(NOT MIMESIS_TREE)
    target_link_libraries(${name} PUBLIC Mimesis::proto)  # "proto/header.pb.h" and the others
  endif()
endfunction()
