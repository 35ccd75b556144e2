# find_package(Mimesis): libraries mimesis_runtime, mimesis_proto, mimesis_kin ... and the functions of
# MimesisFunctions.cmake. Debian's packages are those of tools/packages.txt, group core.
include(CMakeFindDependencyMacro)
foreach(package Threads PkgConfig Protobuf fmt spdlog yaml-cpp CLI11 nlohmann_json)
  find_dependency(${package})
endforeach()
find_dependency(Eigen3 3.4 NO_MODULE)
foreach(module zmq=libzmq lz4=liblz4 zstd=libzstd zlib=zlib deflate=libdeflate png=libpng jpeg=libturbojpeg
    urdfdom=urdfdom assimp=assimp)
  string(REPLACE "=" ";" module ${module})
  list(GET module 0 name)
  list(GET module 1 pc)
  if(NOT TARGET PkgConfig::${name})
    pkg_check_modules(${name} REQUIRED QUIET IMPORTED_TARGET ${pc})
  endif()
endforeach()

include(${CMAKE_CURRENT_LIST_DIR}/MimesisExport.cmake)
if(NOT CMAKE_RUNTIME_OUTPUT_DIRECTORY)
  set(CMAKE_RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/bin)
endif()
set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
add_compile_options(-ffp-contract=off)  # same inputs, same bits: replay depends on it
if(NOT TARGET mimesis_warnings)
  add_library(mimesis_warnings INTERFACE)
  target_compile_options(mimesis_warnings INTERFACE -Wall -Wextra)
endif()
get_filename_component(MIMESIS_PREFIX ${CMAKE_CURRENT_LIST_DIR}/../../.. ABSOLUTE)
set(MIMESIS_PROTO_PATH ${MIMESIS_PREFIX}/share/mimesis)
set(MIMESIS_INSTALLED_SOURCES ${CMAKE_CURRENT_LIST_DIR}/none)  # users install their own
include(${CMAKE_CURRENT_LIST_DIR}/MimesisFunctions.cmake)
