# Debian's packages (tools/packages.txt). Heavy ones are linked where needed, never globally.
find_package(Threads REQUIRED)
find_package(PkgConfig REQUIRED)
find_package(Protobuf REQUIRED)
find_package(Eigen3 3.4 REQUIRED NO_MODULE)
if(MIMESIS_SANITIZE MATCHES "address")
  # Else Eigen allocates otherwise under this sanitizer than in DART, which frees what we allocate. For all targets: they
  # share precompiled headers.
  add_compile_definitions(EIGEN_MALLOC_ALREADY_ALIGNED=1)
endif()
find_package(spdlog REQUIRED)
find_package(fmt REQUIRED)
find_package(yaml-cpp REQUIRED)
find_package(GTest REQUIRED)
find_package(benchmark REQUIRED)
find_package(CLI11 REQUIRED)
find_package(nlohmann_json REQUIRED)
pkg_check_modules(zmq REQUIRED IMPORTED_TARGET libzmq)
pkg_check_modules(modbus REQUIRED IMPORTED_TARGET libmodbus)
pkg_check_modules(lz4 REQUIRED IMPORTED_TARGET liblz4)
pkg_check_modules(zstd REQUIRED IMPORTED_TARGET libzstd)
pkg_check_modules(zlib REQUIRED IMPORTED_TARGET zlib)
pkg_check_modules(deflate REQUIRED IMPORTED_TARGET libdeflate)
pkg_check_modules(png REQUIRED IMPORTED_TARGET libpng)
pkg_check_modules(jpeg REQUIRED IMPORTED_TARGET libturbojpeg libjpeg)
pkg_check_modules(urdfdom REQUIRED IMPORTED_TARGET urdfdom)
pkg_check_modules(assimp REQUIRED IMPORTED_TARGET assimp)
pkg_check_modules(qhull REQUIRED IMPORTED_TARGET qhull_r)
pkg_check_modules(tinyxml REQUIRED IMPORTED_TARGET tinyxml)
pkg_check_modules(sodium REQUIRED IMPORTED_TARGET libsodium)
pkg_check_modules(systemd REQUIRED IMPORTED_TARGET libsystemd)

# Only these modules of OpenCV: Debian's imgcodecs and videoio load GPL libraries (poppler, x264).
find_path(OPENCV_INCLUDE opencv2/core.hpp PATH_SUFFIXES opencv4 REQUIRED)
foreach(module core imgproc calib3d)
  find_library(OPENCV_${module} opencv_${module} REQUIRED)
  add_library(opencv::${module} UNKNOWN IMPORTED)
  set_target_properties(opencv::${module} PROPERTIES
    IMPORTED_LOCATION ${OPENCV_${module}}
    INTERFACE_INCLUDE_DIRECTORIES ${OPENCV_INCLUDE})
endforeach()

# Debian's package of LIBSVM brings no CMake or pkg-config file.
find_path(LIBSVM_INCLUDE svm.h PATH_SUFFIXES libsvm REQUIRED)
find_library(LIBSVM_LIBRARY svm REQUIRED)
add_library(libsvm::libsvm UNKNOWN IMPORTED)
set_target_properties(libsvm::libsvm PROPERTIES
  IMPORTED_LOCATION ${LIBSVM_LIBRARY}
  INTERFACE_INCLUDE_DIRECTORIES ${LIBSVM_INCLUDE})

# Physics of the simulated biped: group walking. Without it hw/sim/body and its users are not built.
find_package(DART 6.12 QUIET COMPONENTS utils-urdf)
if(NOT DART_FOUND)
  message(STATUS "no DART: the simulated biped is left out (tools/setup walking)")
endif()
