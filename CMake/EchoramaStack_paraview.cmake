# The ParaView stack (5.11 or later): the same modules as one plugin, over the kernels that the vtk stack built.
set(ECHORAMA_KERNELS_DIR "" CACHE PATH "build tree of the vtk stack")
set(ECHORAMA_PARAVIEW_PREFIX "" CACHE PATH "what CMake/paraview-overlay.sh made")
if(NOT EXISTS ${ECHORAMA_KERNELS_DIR}/EchoramaKernels-targets.cmake)
  message(FATAL_ERROR "ECHORAMA_KERNELS_DIR (${ECHORAMA_KERNELS_DIR}) holds no kernels; configure the vtk stack there first")
endif()
# RemotingViews brings the X11 and GLEW targets; without COMPONENTS ParaView asks for more than the plugin needs.
find_package(ParaView 5.11 REQUIRED COMPONENTS RemotingCore RemotingServerManager RemotingViews VTKExtensionsCore VTKExtensionsMisc
  HINTS ${ECHORAMA_PARAVIEW_PREFIX}/prefix/usr)
message(STATUS "ParaView ${ParaView_VERSION}")
include(EchoramaDependencies)
include(${ECHORAMA_KERNELS_DIR}/EchoramaKernels-targets.cmake)
set(ECHORAMA_PYTHON_PACKAGES python3/paraview-packages CACHE STRING "folder of the Python package, relative to the build tree and to the prefix")

set(modules)
foreach(room IN LISTS ECHORAMA_ROOMS)
  if(EXISTS ${PROJECT_SOURCE_DIR}/${room}/vtk.module) # else it is a room of kernels alone
    string(REPLACE "/" "" module ${room})
    list(APPEND modules Echorama::${module})
  endif()
endforeach()

paraview_plugin_scan(PLUGIN_FILES ${PROJECT_SOURCE_DIR}/Plugin/paraview.plugin
  PROVIDES_PLUGINS plugins ENABLE_BY_DEFAULT ON HIDE_PLUGINS_FROM_CACHE ON)
paraview_plugin_build(PLUGINS ${plugins}
  RUNTIME_DESTINATION ${CMAKE_INSTALL_BINDIR}
  LIBRARY_DESTINATION ${CMAKE_INSTALL_LIBDIR}
  LIBRARY_SUBDIRECTORY paraview-${ParaView_VERSION_MAJOR}.${ParaView_VERSION_MINOR}/plugins)
# paraview_plugin_build does not wrap the modules for Python.
vtk_module_wrap_python(MODULES ${modules} INSTALL_EXPORT EchoramaParaViewPython PYTHON_PACKAGE echorama
  MODULE_DESTINATION ${ECHORAMA_PYTHON_PACKAGES} CMAKE_DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/echorama-paraview
  INSTALL_HEADERS OFF BUILD_STATIC OFF TARGET Echorama::Python) # VTK 9.3 would install a header with the name of Python's own
include(EchoramaPythonPackage)

if(ECHORAMA_TESTING)
  add_subdirectory(Plugin/Testing)
endif()
include(EchoramaPackaging)
