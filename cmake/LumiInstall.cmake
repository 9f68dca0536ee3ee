# What an installation has beside the programs (lumi_program) and the modules that they load (lumi_module): the libraries
# for others' programs, manual pages, completion of shells, the desktop's files, the Python module; and the Debian packages
# that CPack makes of it (scripts/package.sh).
#
# Components: programs, development, python.
include(CMakePackageConfigHelpers)
set(LUMI_MAINTAINER "The authors of Lumigraph <lumigraph@example.org>" CACHE STRING "Who answers for the Debian packages")

# find_package(Lumigraph): cameras, files and the renderer, without programs' own libraries.
set(exported lumi_dense_solvers lumi_scene_model lumi_scene lumi_triangulation lumi_render)
if(TARGET lumi_json)
  list(APPEND exported lumi_json)
endif()
set(config_dir ${CMAKE_INSTALL_LIBDIR}/cmake/Lumigraph)
install(TARGETS ${exported} EXPORT LumigraphTargets ARCHIVE COMPONENT development)
install(EXPORT LumigraphTargets NAMESPACE Lumigraph:: DESTINATION ${config_dir} COMPONENT development)
configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/LumigraphConfig.cmake.in ${CMAKE_BINARY_DIR}/LumigraphConfig.cmake
  INSTALL_DESTINATION ${config_dir})
write_basic_package_version_file(${CMAKE_BINARY_DIR}/LumigraphConfigVersion.cmake COMPATIBILITY ExactVersion)
install(FILES ${CMAKE_BINARY_DIR}/LumigraphConfig.cmake ${CMAKE_BINARY_DIR}/LumigraphConfigVersion.cmake
  DESTINATION ${config_dir} COMPONENT development)
foreach(folder IN ITEMS scene render)
  install(DIRECTORY ${CMAKE_SOURCE_DIR}/${folder} DESTINATION include/lumigraph COMPONENT development
    FILES_MATCHING PATTERN "*.h" PATTERN viewer EXCLUDE PATTERN gl EXCLUDE PATTERN commands EXCLUDE PATTERN tradeoff EXCLUDE)
endforeach()

# A manual page a program, of its own --help: `cmake --build build/release --target man`, where help2man is installed.
find_program(LUMI_HELP2MAN help2man)
set(programs lumi-calibrate lumi-export lumi-pipeline lumi-proxy lumi-reconstruct lumi-render lumi-simulate lumi-stabilize lumi-timeperiodic lumi-view)
set(pages "")
foreach(program IN LISTS programs)
  if(NOT TARGET ${program} OR NOT LUMI_HELP2MAN)
    continue()
  endif()
  set(page ${CMAKE_BINARY_DIR}/man/${program}.1)
  add_custom_command(OUTPUT ${page}
    COMMAND ${CMAKE_COMMAND} -E make_directory ${CMAKE_BINARY_DIR}/man
    COMMAND ${CMAKE_SOURCE_DIR}/packaging/man-page.sh ${LUMI_HELP2MAN} $<TARGET_FILE:${program}> ${page}
    DEPENDS ${program} ${CMAKE_SOURCE_DIR}/packaging/man-page.sh VERBATIM)
  list(APPEND pages ${page})
endforeach()
add_custom_target(man DEPENDS ${pages})
install(DIRECTORY ${CMAKE_BINARY_DIR}/man/ DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT programs FILES_MATCHING PATTERN "*.1.gz")

install(FILES ${CMAKE_SOURCE_DIR}/packaging/completion/lumigraph.bash
  DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions RENAME lumi-render COMPONENT programs)
foreach(program IN LISTS programs)
  if(TARGET ${program} AND NOT program STREQUAL lumi-render)
    install(CODE "file(CREATE_LINK lumi-render \$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_DATADIR}/bash-completion/completions/${program} SYMBOLIC)
list(APPEND CMAKE_INSTALL_MANIFEST_FILES \${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_DATADIR}/bash-completion/completions/${program})" COMPONENT programs)
  endif()
endforeach()
install(FILES ${CMAKE_SOURCE_DIR}/packaging/completion/_lumigraph DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/vendor-completions COMPONENT programs)
# What Debian asks of a package.
file(CONFIGURE OUTPUT ${CMAKE_BINARY_DIR}/debian/changelog CONTENT "lumigraph (@PROJECT_VERSION@) unstable; urgency=medium

  * See CHANGELOG.md.

 -- @LUMI_MAINTAINER@  Thu, 26 Nov 2026 12:00:00 +0000
" @ONLY)
file(ARCHIVE_CREATE OUTPUT ${CMAKE_BINARY_DIR}/debian/changelog.gz PATHS ${CMAKE_BINARY_DIR}/debian/changelog FORMAT raw COMPRESSION GZip)
foreach(component_package IN ITEMS programs/lumigraph development/liblumigraph-dev python/python3-lumigraph)
  string(REPLACE "/" ";" pair ${component_package})
  list(GET pair 0 component)
  list(GET pair 1 package)
  set(of_packages_alone EXCLUDE_FROM_ALL)
  if(component STREQUAL programs)
    set(of_packages_alone "")
  endif()
  install(FILES ${CMAKE_SOURCE_DIR}/packaging/debian/copyright ${CMAKE_BINARY_DIR}/debian/changelog.gz
    DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${package} COMPONENT ${component} ${of_packages_alone})
endforeach()
if(TARGET lumi-view)
  install(FILES ${CMAKE_SOURCE_DIR}/packaging/desktop/lumi-view.desktop DESTINATION ${CMAKE_INSTALL_DATADIR}/applications COMPONENT programs)
  install(FILES ${CMAKE_SOURCE_DIR}/packaging/desktop/lumigraph.svg DESTINATION ${CMAKE_INSTALL_DATADIR}/icons/hicolor/scalable/apps COMPONENT programs)
  install(FILES ${CMAKE_SOURCE_DIR}/packaging/desktop/lumigraph.xml DESTINATION ${CMAKE_INSTALL_DATADIR}/mime/packages COMPONENT programs)
endif()
if(LUMI_PYTHON)
  # Of the Debian package alone: elsewhere interpreters have places of their own, which pip knows (docs/python.md).
  set(modules lib/python3/dist-packages)
  install(TARGETS lumi_python DESTINATION ${modules}/lumigraph COMPONENT python EXCLUDE_FROM_ALL)
  install(DIRECTORY ${CMAKE_SOURCE_DIR}/python/lumigraph DESTINATION ${modules} COMPONENT python EXCLUDE_FROM_ALL
    FILES_MATCHING PATTERN "*.py" PATTERN "*.pyi" PATTERN py.typed PATTERN __pycache__ EXCLUDE)
endif()

# What an installation wrote, and its folders that are empty then.
add_custom_target(uninstall COMMAND ${CMAKE_COMMAND} -D BUILD=${CMAKE_BINARY_DIR} -P ${CMAKE_CURRENT_LIST_DIR}/Uninstall.cmake VERBATIM)

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME lumigraph)
set(CPACK_PACKAGE_CONTACT ${LUMI_MAINTAINER})
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "walk through a place that was photographed")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_ALL programs development python)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION graphics)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PROGRAMS_PACKAGE_NAME lumigraph)
set(CPACK_DEBIAN_PROGRAMS_PACKAGE_DEPENDS "colmap, ffmpeg")
set(CPACK_DEBIAN_PROGRAMS_DESCRIPTION "Programs and a viewer that turn a folder of photos, or a video, into an
 unstructured lumigraph (Buehler 2002): photographs, their cameras and a rough
 geometric proxy, rendered from any viewpoint by blending the photographs.")
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME liblumigraph-dev)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SHLIBDEPS OFF)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS "lumigraph (= ${PROJECT_VERSION}), libeigen3-dev, libopencv-dev, libembree-dev, libtbb-dev, libfmt-dev, nlohmann-json3-dev, libopenimageio-dev")
set(CPACK_DEBIAN_DEVELOPMENT_DESCRIPTION "This package is for programs of one's own. It holds static libraries
 and headers: scenes, their files, and the renderer; CMake finds them as
 find_package(Lumigraph).")
math(EXPR python_next_minor "${Python_VERSION_MINOR} + 1")
set(python_next "${Python_VERSION_MAJOR}.${python_next_minor}")
set(CPACK_DEBIAN_PYTHON_PACKAGE_NAME python3-lumigraph)
set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS "lumigraph (= ${PROJECT_VERSION}), python3 (>= ${Python_VERSION_MAJOR}.${Python_VERSION_MINOR}), python3 (<< ${python_next}), python3-numpy")
set(CPACK_DEBIAN_PYTHON_PACKAGE_CONTROL_EXTRA "${CMAKE_SOURCE_DIR}/packaging/debian/python/postinst;${CMAKE_SOURCE_DIR}/packaging/debian/python/prerm")
set(CPACK_DEBIAN_PYTHON_DESCRIPTION "This package is for Python: scenes, weights and pictures as NumPy arrays.")
include(CPack)
