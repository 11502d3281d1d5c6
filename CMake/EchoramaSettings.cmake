# How every target of ours is compiled.
include(GNUInstallDirs)

set(CMAKE_CXX_STANDARD 17) # VTK 9.1's SMP headers do not compile as C++20
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
set(CMAKE_CXX_VISIBILITY_PRESET hidden)
set(CMAKE_VISIBILITY_INLINES_HIDDEN ON)
set(BUILD_SHARED_LIBS ON)
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/bin)
set(CMAKE_LIBRARY_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/lib)
set(CMAKE_ARCHIVE_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/lib)
# Installed libraries find each other wherever the tree is put: kernels lie in lib, the plugin below it, programs in bin, the
# Python package in python3/dist-packages/echorama.
set(CMAKE_INSTALL_RPATH "$ORIGIN;$ORIGIN/..;$ORIGIN/../../..;$ORIGIN/../${CMAKE_INSTALL_LIBDIR};$ORIGIN/../../../${CMAKE_INSTALL_LIBDIR}")

find_program(ECHORAMA_CCACHE ccache)
if(ECHORAMA_CCACHE)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CMAKE_COMMAND} -E env CCACHE_BASEDIR=${CMAKE_SOURCE_DIR} CCACHE_NOHASHDIR=1
      CCACHE_SLOPPINESS=pch_defines,time_macros ${ECHORAMA_CCACHE})
endif()

# echorama_compile_options(TARGET): instruction set, and warnings for our own (never for generated) code.
function(echorama_compile_options target)
  # Contraction would give other numbers where fused multiply-add exists: off, so that all builds agree.
  target_compile_options(${target} PRIVATE -ffp-contract=off)
  # Nobody reads errno or floating-point traps; without these two, loops with a square root or a comparison are not
  # vectorised. Neither changes a result.
  target_compile_options(${target} PRIVATE -fno-math-errno -fno-trapping-math)
  if(ECHORAMA_NATIVE)
    target_compile_options(${target} PRIVATE -march=native)
  elseif(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")
    target_compile_options(${target} PRIVATE -march=x86-64-v2)
    target_compile_definitions(${target} PRIVATE ECHORAMA_MULTIVERSION)
  endif()
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wshadow -Wnon-virtual-dtor -Woverloaded-virtual
    # & between truths is meant where a branch would keep a loop from being vectorised.
    $<$<CXX_COMPILER_ID:Clang>:-Wno-bitwise-instead-of-logical;-Wno-bitwise-conditional-parentheses>
    # GCC 12's vector intrinsics leave variables undefined by initialising them with themselves (GCC bug 105593).
    $<$<AND:$<CXX_COMPILER_ID:GNU>,$<VERSION_LESS:$<CXX_COMPILER_VERSION>,13>>:-Wno-init-self>
    $<$<BOOL:${ECHORAMA_STRICT}>:-Werror>)
endfunction()
