# The OpenGL backend. Included by render/CMakeLists.txt.

lumi_library(lumi_render_gl
  SOURCES
    ${CMAKE_CURRENT_LIST_DIR}/blend_shader.cc
    ${CMAKE_CURRENT_LIST_DIR}/cull_shader.cc
    ${CMAKE_CURRENT_LIST_DIR}/depth_shader.cc
    ${CMAKE_CURRENT_LIST_DIR}/egl_context.cc
    ${CMAKE_CURRENT_LIST_DIR}/gl_lumigraph.cc
    ${CMAKE_CURRENT_LIST_DIR}/gl_objects.cc
    ${CMAKE_CURRENT_LIST_DIR}/gl_renderer.cc
    ${CMAKE_CURRENT_LIST_DIR}/gl_target.cc
    ${CMAKE_CURRENT_LIST_DIR}/gl_uploads.cc
    ${CMAKE_CURRENT_LIST_DIR}/hole_fill.cc
    ${CMAKE_CURRENT_LIST_DIR}/measures_shader.cc
    ${CMAKE_CURRENT_LIST_DIR}/photo_shader.cc
    ${CMAKE_CURRENT_LIST_DIR}/photo_textures.cc
    ${CMAKE_CURRENT_LIST_DIR}/sparse_drawing.cc
    ${CMAKE_CURRENT_LIST_DIR}/sparse_shader.cc
  PUBLIC lumi_render lumi_scene
  PRIVATE PkgConfig::EPOXY fmt::fmt ${CMAKE_DL_LIBS})
