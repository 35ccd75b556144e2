# Language, warnings, sanitizers, output folders, faster tools where present.
set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/bin)
if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE Release CACHE STRING "" FORCE)
endif()
set(CMAKE_CXX_FLAGS_RELEASE "-O2 -DNDEBUG")
set(CMAKE_CXX_FLAGS_RELWITHDEBINFO "-O1 -g")

set(MIMESIS_SANITIZE "" CACHE STRING "Sanitizers, comma separated: address,undefined or thread")
option(MIMESIS_FUZZ "Programs for libFuzzer; needs clang" OFF)
option(MIMESIS_PEERS "Benchmark foreign programs beside ours where they are installed" ON)

# One rounding per operation, whatever the build: same inputs, same bits.
add_compile_options(-ffp-contract=off)
if(MIMESIS_SANITIZE)
  set(CMAKE_CXX_FLAGS_RELWITHDEBINFO "-O1 -g1")  # line tables are all that a report needs, a third faster to compile
  add_compile_options(-fsanitize=${MIMESIS_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all)
  add_link_options(-fsanitize=${MIMESIS_SANITIZE})
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    add_compile_options(-Wno-maybe-uninitialized)  # with sanitizers g++ 12 suspects Eigen's aliasing check
  endif()
endif()

if(MIMESIS_FUZZ)
  add_compile_options(-fsanitize=fuzzer-no-link)
endif()

if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  # Templates fill the compiler's memory, and to search that for garbage takes a tenth of its time: begin at 1 GB.
  add_compile_options("SHELL:--param ggc-min-heapsize=1000000")
endif()

find_program(MIMESIS_CCACHE ccache)
if(MIMESIS_CCACHE)
  # ccache needs the first to keep objects compiled with precompiled headers; with the second it hashes a header once, not
  # once for each source; with the others checkouts in several folders share their objects.
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CMAKE_COMMAND} -E env CCACHE_SLOPPINESS=pch_defines,time_macros CCACHE_INODECACHE=true
    CCACHE_BASEDIR=${CMAKE_SOURCE_DIR} CCACHE_NOHASHDIR=true ${MIMESIS_CCACHE})
endif()
# Not mold: Debian 12's now and then ends the RELRO segment behind the last mapped page, and such a program does not start.
find_program(MIMESIS_LLD ld.lld)
if(MIMESIS_LLD)
  add_link_options(-fuse-ld=lld)
endif()

# Libraries compile in batches of this number of files: most of the cost of a file is its headers.
option(MIMESIS_BATCHES "Compile libraries in batches (unity builds)" ON)
set(CMAKE_UNITY_BUILD ${MIMESIS_BATCHES})
set(CMAKE_UNITY_BUILD_BATCH_SIZE 8)

# All targets of this project link this; generated code does not.
add_library(mimesis_warnings INTERFACE)
# Without clang's -Wshadow, which takes the constants of another file of a batch for shadowed.
target_compile_options(mimesis_warnings INTERFACE
  -Wall -Wextra -Wpedantic $<$<CXX_COMPILER_ID:GNU>:-Wshadow> -Wconversion -Werror)
target_link_libraries(mimesis_warnings INTERFACE fmt::fmt)  # its macro must be the same in all that share headers
