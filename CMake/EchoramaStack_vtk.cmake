# The VTK stack (9.1 or later): kernels, modules, Python package, programs, installation.
set(ECHORAMA_VTK_COMPONENTS # what our modules use; find_package(Echorama) asks for the same
  CommonCore CommonDataModel CommonExecutionModel CommonTransforms CommonMath CommonSystem CommonColor CommonMisc
  FiltersCore FiltersGeneral FiltersSources IOCore IOGeometry IOImage IOXML IOLegacy ImagingCore ImagingGeneral ImagingMath ParallelCore
  InteractionStyle InteractionWidgets RenderingAnnotation RenderingCore RenderingFreeType RenderingOpenGL2
  RenderingVolume RenderingVolumeOpenGL2 RenderingImage)
find_package(VTK 9.1 REQUIRED COMPONENTS ${ECHORAMA_VTK_COMPONENTS} FiltersHybrid ImagingFourier ImagingHybrid IOPLY # the last four: peers in benchmarks
  Python WrappingPythonCore WrappingTools
  OPTIONAL_COMPONENTS GUISupportQt) # the windows' alone: other projects need no Qt
find_package(Qt5 QUIET COMPONENTS OpenGL Widgets Test) # here, where VTK's targets look for it
include(EchoramaDependencies)
set(ECHORAMA_PYTHON /usr/bin/python3) # Debian's VTK is wrapped for Debian's Python, whatever else is on PATH
set(ECHORAMA_PYTHON_PACKAGES python3/dist-packages CACHE STRING "folder of the Python package, relative to the build tree and to the prefix")
set(ECHORAMA_PYTHON_PATH ${CMAKE_BINARY_DIR}/${ECHORAMA_PYTHON_PACKAGES})

# Rooms of kernels alone are no modules of VTK.
set(module_files)
foreach(room IN LISTS ECHORAMA_ROOMS)
  if(EXISTS ${PROJECT_SOURCE_DIR}/${room}/vtk.module)
    list(APPEND module_files ${PROJECT_SOURCE_DIR}/${room}/vtk.module)
  else()
    add_subdirectory(${room})
  endif()
endforeach()
vtk_module_scan(MODULE_FILES ${module_files} PROVIDES_MODULES modules WANT_BY_DEFAULT ON HIDE_MODULES_FROM_CACHE ON
  ENABLE_TESTS OFF)
vtk_module_build(MODULES ${modules} PACKAGE Echorama INSTALL_EXPORT Echorama
  VERSION ${PROJECT_VERSION} SOVERSION ${PROJECT_VERSION_MAJOR}
  HEADERS_DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/echorama
  CMAKE_DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/echorama)
vtk_module_wrap_python(MODULES ${modules} INSTALL_EXPORT EchoramaPython PYTHON_PACKAGE echorama
  MODULE_DESTINATION ${ECHORAMA_PYTHON_PACKAGES} CMAKE_DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/echorama
  INSTALL_HEADERS OFF BUILD_STATIC OFF TARGET Echorama::Python) # VTK 9.3 would install a header with the name of Python's own
include(EchoramaPythonPackage)

# The kernels, for the ParaView stack (from this build tree) and for other projects (installed).
get_property(kernel_targets GLOBAL PROPERTY ECHORAMA_KERNEL_TARGETS)
export(TARGETS ${kernel_targets} NAMESPACE Echorama:: FILE ${CMAKE_BINARY_DIR}/EchoramaKernels-targets.cmake)
install(EXPORT EchoramaKernels NAMESPACE Echorama:: FILE EchoramaKernels-targets.cmake
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/echorama COMPONENT development)
include(EchoramaPackage)

add_subdirectory(Applications)
if(ECHORAMA_TESTING)
  add_subdirectory(Testing)
endif()
include(EchoramaPackaging)
