# SPDX-License-Identifier: Apache-2.0
# Install rules and the package that find_package(Trammel) finds, in lower case too.
include(CMakePackageConfigHelpers)

set(TRAMMEL_PACKAGE_FOLDER "${CMAKE_INSTALL_LIBDIR}/cmake/Trammel")
install(TARGETS trammel_headers trammel EXPORT TrammelTargets
  ARCHIVE DESTINATION "${CMAKE_INSTALL_LIBDIR}"
  FILE_SET HEADERS DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}")
install(EXPORT TrammelTargets NAMESPACE trammel:: DESTINATION "${TRAMMEL_PACKAGE_FOLDER}")
configure_package_config_file("${CMAKE_CURRENT_LIST_DIR}/trammel-config.cmake.in"
  "${CMAKE_CURRENT_BINARY_DIR}/trammel-config.cmake" INSTALL_DESTINATION "${TRAMMEL_PACKAGE_FOLDER}")
write_basic_package_version_file("${CMAKE_CURRENT_BINARY_DIR}/trammel-config-version.cmake"
  COMPATIBILITY SameMinorVersion)
install(FILES "${CMAKE_CURRENT_BINARY_DIR}/trammel-config.cmake"
  "${CMAKE_CURRENT_BINARY_DIR}/trammel-config-version.cmake" DESTINATION "${TRAMMEL_PACKAGE_FOLDER}")
install(FILES "${PROJECT_SOURCE_DIR}/LICENSE" DESTINATION "${CMAKE_INSTALL_DATADIR}/doc/trammel")
if(TARGET trammel_program)
  install(TARGETS trammel_program RUNTIME DESTINATION "${CMAKE_INSTALL_BINDIR}")
  install(FILES "${PROJECT_SOURCE_DIR}/src/report/third_party/LICENSE.uPlot"
    DESTINATION "${CMAKE_INSTALL_DATADIR}/doc/trammel")
endif()
