# find_package(Echorama) for other projects.
include(CMakePackageConfigHelpers)
configure_package_config_file(${PROJECT_SOURCE_DIR}/CMake/EchoramaConfig.cmake.in ${CMAKE_BINARY_DIR}/EchoramaConfig.cmake
  INSTALL_DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/echorama)
write_basic_package_version_file(${CMAKE_BINARY_DIR}/EchoramaConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_BINARY_DIR}/EchoramaConfig.cmake ${CMAKE_BINARY_DIR}/EchoramaConfigVersion.cmake
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/echorama COMPONENT development)
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE ${PROJECT_SOURCE_DIR}/THIRD_PARTY.md DESTINATION ${CMAKE_INSTALL_DOCDIR})
