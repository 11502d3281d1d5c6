# What the kernels need; VTK and ParaView are found by their stacks.
find_package(Eigen3 3.4 REQUIRED NO_MODULE)
find_package(TBB REQUIRED)
find_package(ZLIB REQUIRED)
find_package(nlohmann_json 3 REQUIRED)
find_package(pugixml REQUIRED)
find_package(PNG REQUIRED)
find_package(JPEG REQUIRED)
find_package(TIFF REQUIRED)
find_package(Threads REQUIRED)
# Debian's GDCMConfig.cmake names programs of packages that need not be there.
find_path(ECHORAMA_GDCM_INCLUDE_DIR gdcmReader.h PATH_SUFFIXES gdcm-3.0 REQUIRED)
add_library(Echorama_gdcm INTERFACE IMPORTED)
target_include_directories(Echorama_gdcm SYSTEM INTERFACE ${ECHORAMA_GDCM_INCLUDE_DIR})
foreach(library gdcmMSFF gdcmDSED gdcmCommon)
  find_library(ECHORAMA_${library} ${library} REQUIRED)
  target_link_libraries(Echorama_gdcm INTERFACE ${ECHORAMA_${library}})
endforeach()
# OpenVDB's own find module asks for more than its headers need (log4cplus, Boost's CMake files ...).
find_path(ECHORAMA_OPENVDB_INCLUDE_DIR openvdb/openvdb.h REQUIRED)
find_library(ECHORAMA_OPENVDB openvdb REQUIRED)
find_library(ECHORAMA_IMATH NAMES Imath Imath-3_1 REQUIRED)
add_library(Echorama_OpenVDB INTERFACE IMPORTED)
target_include_directories(Echorama_OpenVDB SYSTEM INTERFACE ${ECHORAMA_OPENVDB_INCLUDE_DIR})
target_link_libraries(Echorama_OpenVDB INTERFACE ${ECHORAMA_OPENVDB} ${ECHORAMA_IMATH} TBB::tbb)
# Ceres' own configuration names its static library. That one shares Eigen's inline functions with our code, which may be
# compiled for another instruction set and then allocates memory in another way: it frees what it did not allocate. The shared
# library keeps its own to itself.
find_path(ECHORAMA_CERES_INCLUDE_DIR ceres/manifold.h REQUIRED)
find_library(ECHORAMA_CERES NAMES libceres.so libceres.dylib ceres REQUIRED)
add_library(Echorama_Ceres INTERFACE IMPORTED)
target_include_directories(Echorama_Ceres SYSTEM INTERFACE ${ECHORAMA_CERES_INCLUDE_DIR})
target_link_libraries(Echorama_Ceres INTERFACE ${ECHORAMA_CERES})
# The FFT (BSD-3-Clause, one header) comes with Debian's pythran.
find_path(ECHORAMA_POCKETFFT_INCLUDE_DIR pocketfft.hpp
  PATHS /usr/lib/python3/dist-packages/pythran/pythonic/numpy/fft REQUIRED)
add_library(Echorama_PocketFFT INTERFACE IMPORTED)
target_include_directories(Echorama_PocketFFT SYSTEM INTERFACE ${ECHORAMA_POCKETFFT_INCLUDE_DIR})
# Embree's own configuration looks for a TBB of another name.
find_path(ECHORAMA_EMBREE_INCLUDE_DIR embree3/rtcore.h REQUIRED)
find_library(ECHORAMA_EMBREE embree3 REQUIRED)
add_library(Echorama_Embree INTERFACE IMPORTED)
target_include_directories(Echorama_Embree SYSTEM INTERFACE ${ECHORAMA_EMBREE_INCLUDE_DIR})
target_link_libraries(Echorama_Embree INTERFACE ${ECHORAMA_EMBREE})
if(ECHORAMA_TESTING)
  find_package(GTest REQUIRED)
  include(GoogleTest)
endif()
