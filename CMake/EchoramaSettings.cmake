# How every target of ours is compiled.
include(GNUInstallDirs)
set(CMAKE_INSTALL_DEFAULT_COMPONENT_NAME runtime) # packages are made of components (EchoramaPackaging)

set(CMAKE_CXX_STANDARD 17) # VTK 9.1's SMP headers do not compile as C++20
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
set(CMAKE_CXX_VISIBILITY_PRESET hidden)
set(CMAKE_VISIBILITY_INLINES_HIDDEN ON)
set(BUILD_SHARED_LIBS ON)
set(ECHORAMA_EIGEN_INTERFACE EIGEN_MAX_ALIGN_BYTES=16 EIGEN_MALLOC_ALREADY_ALIGNED=0) # of kernels, and of all who use them
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/bin)
set(CMAKE_LIBRARY_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/lib)
set(CMAKE_ARCHIVE_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/lib)
# Kernels of levels that are not built any more would be taken all the same.
file(GLOB levels RELATIVE ${CMAKE_LIBRARY_OUTPUT_DIRECTORY}/glibc-hwcaps ${CMAKE_LIBRARY_OUTPUT_DIRECTORY}/glibc-hwcaps/*)
foreach(level IN LISTS levels)
  if(NOT level IN_LIST ECHORAMA_CPU_LEVELS)
    file(REMOVE_RECURSE ${CMAKE_LIBRARY_OUTPUT_DIRECTORY}/glibc-hwcaps/${level})
  endif()
endforeach()
# Installed libraries find each other wherever the tree is put: kernels lie in lib, the plugin below it, programs in bin, the
# Python package in python3/dist-packages/echorama.
set(CMAKE_INSTALL_RPATH "$ORIGIN;$ORIGIN/..;$ORIGIN/../../..;$ORIGIN/../${CMAKE_INSTALL_LIBDIR};$ORIGIN/../../../${CMAKE_INSTALL_LIBDIR}")

find_program(ECHORAMA_CCACHE ccache)
if(ECHORAMA_CCACHE)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CMAKE_COMMAND} -E env CCACHE_BASEDIR=${CMAKE_SOURCE_DIR} CCACHE_NOHASHDIR=1
      CCACHE_SLOPPINESS=pch_defines,time_macros,include_file_mtime,include_file_ctime ${ECHORAMA_CCACHE})
endif()

# echorama_compile_options(TARGET [CPU]): instruction set (default: ECHORAMA_CPU), and warnings for our own (never for generated) code.
function(echorama_compile_options target)
  # Contraction would give other numbers where fused multiply-add exists: off, so that all builds agree.
  target_compile_options(${target} PRIVATE -ffp-contract=off)
  # Nobody reads errno or floating-point traps; without these two, loops with a square root or a comparison are not
  # vectorised. Neither changes a result.
  target_compile_options(${target} PRIVATE -fno-math-errno -fno-trapping-math)
  set(cpu ${ARGN})
  if(NOT cpu)
    set(cpu ${ECHORAMA_CPU})
  endif()
  if(NOT cpu STREQUAL "any")
    target_compile_options(${target} PRIVATE -march=${cpu})
  elseif(ECHORAMA_IS_X86)
    target_compile_options(${target} PRIVATE -march=x86-64-v2)
  endif()
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wnon-virtual-dtor -Woverloaded-virtual
    # & between truths is meant where a branch would keep a loop from being vectorised.
    $<$<CXX_COMPILER_ID:Clang>:-Wno-bitwise-instead-of-logical;-Wno-bitwise-conditional-parentheses>
    # Files that are compiled together neither hide each other's names by mistake nor share types that they should not.
    $<$<CXX_COMPILER_ID:GNU>:-Wshadow=local;-Wno-subobject-linkage>
    # GCC 12's vector intrinsics leave variables undefined by initialising them with themselves (GCC bug 105593).
    $<$<AND:$<CXX_COMPILER_ID:GNU>,$<VERSION_LESS:$<CXX_COMPILER_VERSION>,13>>:-Wno-init-self>
    # GCC 14 takes what a function returns by reference for part of a temporary argument, a key's name for instance.
    $<$<AND:$<CXX_COMPILER_ID:GNU>,$<VERSION_GREATER_EQUAL:$<CXX_COMPILER_VERSION>,13>>:-Wno-dangling-reference>
    $<$<BOOL:${ECHORAMA_STRICT}>:-Werror>)
endfunction()

# echorama_precompile(TARGET KIND [CPU]): the headers that most files of its kind include are parsed once. KIND is
#   kernels, classes   shared libraries: the numerical ones, those of vtk classes
#   tests              GoogleTest programs
# Each kind and CPU has one precompiled header, made by the first target that asks for it. A file still includes what it uses.
set(ECHORAMA_HEADERS_kernels <algorithm> <array> <cmath> <cstdint> <cstring> <filesystem> <fstream> <functional> <limits> <map>
  <memory> <mutex> <numeric> <optional> <set> <sstream> <string> <string_view> <tuple> <utility> <vector>
  <Eigen/Core> <Eigen/Geometry> <Eigen/Cholesky> <Eigen/Eigenvalues> <Eigen/SVD>)
set(ECHORAMA_HEADERS_classes ${ECHORAMA_HEADERS_kernels} <vtkDataObjectTree.h> <vtkImageData.h> <vtkInformation.h>
  <vtkInformationVector.h> <vtkMatrix4x4.h> <vtkNew.h> <vtkObjectFactory.h> <vtkPointData.h> <vtkPolyData.h> <vtkSmartPointer.h>
  <vtkStreamingDemandDrivenPipeline.h> <vtkUnsignedCharArray.h>)
set(ECHORAMA_HEADERS_tests ${ECHORAMA_HEADERS_kernels} <gtest/gtest.h>)
function(echorama_precompile target kind)
  list(JOIN ARGN _ cpu)
  set(maker Echorama_headers_of_${kind}${cpu})
  if(NOT TARGET ${maker})
    file(CONFIGURE OUTPUT ${CMAKE_BINARY_DIR}/${maker}.cxx CONTENT "// holds a precompiled header\n")
    if(kind STREQUAL "tests")
      add_executable(${maker} EXCLUDE_FROM_ALL ${CMAKE_BINARY_DIR}/${maker}.cxx)
      target_link_libraries(${maker} PRIVATE GTest::gtest_main)
      target_compile_options(${maker} PRIVATE -O1)
    else()
      add_library(${maker} OBJECT EXCLUDE_FROM_ALL ${CMAKE_BINARY_DIR}/${maker}.cxx)
    endif()
    echorama_compile_options(${maker} ${ARGN})
    target_compile_definitions(${maker} PRIVATE ${ECHORAMA_EIGEN_INTERFACE})
    target_link_libraries(${maker} PRIVATE Eigen3::Eigen)
    if(kind STREQUAL "classes")
      target_compile_options(${maker} PRIVATE -O1) # as the classes: GCC 14 takes no header made at another level
      target_link_libraries(${maker} PRIVATE VTK::CommonCore VTK::CommonDataModel VTK::CommonExecutionModel)
    elseif(kind STREQUAL "kernels")
      set_target_properties(${maker} PROPERTIES CXX_VISIBILITY_PRESET default VISIBILITY_INLINES_HIDDEN OFF)
    endif()
    # clang writes when each header was changed, which is another time in each clone: a compiler cache would never find anything.
    target_compile_options(${maker} PRIVATE "$<$<CXX_COMPILER_ID:Clang>:SHELL:-Xclang -fno-pch-timestamp>")
    target_precompile_headers(${maker} PRIVATE ${ECHORAMA_HEADERS_${kind}})
  endif()
  target_precompile_headers(${target} REUSE_FROM ${maker})
  target_compile_options(${target} PRIVATE -Winvalid-pch)
endfunction()
