# Functions for nodes, in this tree and outside of it (find_package(Mimesis) brings this file):
# mimesis_add_node(NAME [BENCH SUBJECT] [ALGO_LINK ...] [NODE_LINK ...])
#   By convention of a node's folder: *_node.cc -> NAME_node, main.cc -> mimesis_NAME, other *.cc -> NAME_algo,
#   test/*_process_test.cc -> NAME_process_test (label node), other test/*.cc -> NAME_test (label unit),
#   bench/*.cc -> bench_SUBJECT (default NAME).
# mimesis_add_messages(NAME PROTO ...)                 library NAME of the messages in the .proto files, whose paths are
#   relative to PROJECT_SOURCE_DIR and are those of the headers: msg/a.proto -> "msg/a.pb.h"; they may import "proto/*.proto"
# mimesis_library(NAME SOURCES ... [LINK ...])         a library with this project's warnings
# mimesis_program(NAME SOURCES ... [LINK ...])         build/bin/NAME, part of target `programs`
# mimesis_test(NAME SOURCES ... [LINK ...] [LABEL unit|node|launch|...] [TIMEOUT s])
# mimesis_benchmark(SUBJECT SOURCES ... [LINK ...])    build/bench/bench_SUBJECT

# Programs for a robot or a demo: everything but tests and benchmarks.
add_custom_target(programs)

# Precompiled headers of this tree (MimesisTargets.cmake) and the options they were compiled with, since the compiler
# keeps to those; a target with other options sets DISABLE_PRECOMPILE_HEADERS. Nodes outside of this tree have none.
function(mimesis_reuse_headers name headers)
  if(TARGET ${headers})
    get_target_property(options ${headers} COMPILE_OPTIONS)
    if(options)
      target_compile_options(${name} PRIVATE ${options})
    endif()
    target_precompile_headers(${name} REUSE_FROM ${headers})
  endif()
endfunction()

# Libraries of common/ and proto/ are installed with their headers, for nodes outside of this tree.
function(mimesis_library name)
  cmake_parse_arguments(arg "" "HEADERS" "SOURCES;LINK;PRIVATE_LINK" ${ARGN})
  if(NOT arg_HEADERS)
    set(arg_HEADERS mimesis_headers)
  endif()
  add_library(${name} STATIC ${arg_SOURCES})
  target_include_directories(${name} PUBLIC $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}> $<INSTALL_INTERFACE:include/mimesis>)
  target_link_libraries(${name} PUBLIC ${arg_LINK} PRIVATE $<BUILD_INTERFACE:mimesis_warnings> ${arg_PRIVATE_LINK})
  mimesis_reuse_headers(${name} ${arg_HEADERS})
  cmake_path(IS_PREFIX MIMESIS_INSTALLED_SOURCES ${CMAKE_CURRENT_SOURCE_DIR} installed)
  if(installed)
    install(TARGETS ${name} EXPORT MimesisExport ARCHIVE DESTINATION lib COMPONENT library)
  endif()
endfunction()

function(mimesis_executable name)
  cmake_parse_arguments(arg "" "HEADERS" "SOURCES;LINK" ${ARGN})
  if(NOT arg_HEADERS)
    set(arg_HEADERS mimesis_headers)
  endif()
  add_executable(${name} ${arg_SOURCES})
  target_include_directories(${name} PRIVATE ${PROJECT_SOURCE_DIR})
  target_link_libraries(${name} PRIVATE mimesis_warnings ${arg_LINK})
  mimesis_reuse_headers(${name} ${arg_HEADERS})
endfunction()

# The words of --help and --describe for the parameters of the node in this folder: comments at their declarations.
find_program(MIMESIS_PYTHON NAMES python3 PATHS /usr/bin NO_DEFAULT_PATH)
function(mimesis_explain name)
  set(shared)
  if(EXISTS ${PROJECT_SOURCE_DIR}/common/runtime/params.h)
    set(shared ${PROJECT_SOURCE_DIR}/common)
  endif()
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS *.h *.cc)
  list(FILTER sources EXCLUDE REGEX "/(test|bench|fuzz)/")
  set(script ${CMAKE_CURRENT_FUNCTION_LIST_DIR}/param_help.py)
  set(output ${CMAKE_CURRENT_BINARY_DIR}/${name}_help.cc)
  add_custom_command(OUTPUT ${output}
    COMMAND ${MIMESIS_PYTHON} ${script} ${output} ${CMAKE_CURRENT_SOURCE_DIR} ${shared}
    DEPENDS ${script} ${sources} VERBATIM)
  set_source_files_properties(${output} PROPERTIES SKIP_PRECOMPILE_HEADERS ON)
  target_sources(${name} PRIVATE ${output})
endfunction()

# A program of build/bin.
function(mimesis_program name)
  mimesis_executable(${name} ${ARGN})
  if(MIMESIS_PYTHON AND name MATCHES "^mimesis_" AND EXISTS ${CMAKE_CURRENT_SOURCE_DIR}/main.cc)
    mimesis_explain(${name})
  endif()
  add_dependencies(programs ${name})
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
  mimesis_executable(${name} SOURCES ${arg_SOURCES} LINK ${arg_LINK} GTest::gtest_main HEADERS mimesis_test_headers)
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/test)
  target_compile_definitions(${name} PRIVATE
    MIMESIS_SOURCE_DIR="${PROJECT_SOURCE_DIR}" MIMESIS_BIN_DIR="${CMAKE_BINARY_DIR}/bin")
  add_test(NAME ${name} COMMAND ${name})
  set_tests_properties(${name} PROPERTIES LABELS ${arg_LABEL} TIMEOUT ${arg_TIMEOUT} SKIP_RETURN_CODE 77)
endfunction()

function(mimesis_benchmark subject)
  cmake_parse_arguments(arg "" "" "SOURCES;LINK" ${ARGN})
  mimesis_executable(bench_${subject} SOURCES ${arg_SOURCES} LINK ${arg_LINK} benchmark::benchmark_main)
  set_target_properties(bench_${subject} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/bench)
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

function(mimesis_add_messages name)
  set(generated ${PROJECT_BINARY_DIR}/generated)
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
      COMMAND protobuf::protoc --proto_path=${PROJECT_SOURCE_DIR} --proto_path=${MIMESIS_PROTO_PATH} --cpp_out=${generated}
        ${proto}
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
  target_include_directories(${name} SYSTEM PUBLIC $<BUILD_INTERFACE:${generated}> $<INSTALL_INTERFACE:include/mimesis>)
  target_link_libraries(${name} PUBLIC protobuf::libprotobuf)
  if(NOT name STREQUAL mimesis_proto)
    target_link_libraries(${name} PUBLIC mimesis_proto)  # "proto/header.pb.h" and the others
  endif()
endfunction()
