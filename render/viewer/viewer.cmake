# The interactive viewer. Included by render/CMakeLists.txt after gl.cmake.

# Without a window: testable on its own.
lumi_library(lumi_view_core COLD
  SOURCES
    ${CMAKE_CURRENT_LIST_DIR}/motion_budget.cc
    ${CMAKE_CURRENT_LIST_DIR}/navigation.cc
    ${CMAKE_CURRENT_LIST_DIR}/page_export.cc
    ${CMAKE_CURRENT_LIST_DIR}/photo_loader.cc
    ${CMAKE_CURRENT_LIST_DIR}/recorder.cc
    ${CMAKE_CURRENT_LIST_DIR}/refiner.cc
    ${CMAKE_CURRENT_LIST_DIR}/remembered.cc
    ${CMAKE_CURRENT_LIST_DIR}/script.cc
    ${CMAKE_CURRENT_LIST_DIR}/seen.cc
    ${CMAKE_CURRENT_LIST_DIR}/setting_rules.cc
  PUBLIC lumi_render lumi_render_tradeoff lumi_scene
  PRIVATE fmt::fmt Threads::Threads)

lumi_library(lumi_view COLD
  SOURCES
    ${CMAKE_CURRENT_LIST_DIR}/canvas.cc
    ${CMAKE_CURRENT_LIST_DIR}/error_probe.cc
    ${CMAKE_CURRENT_LIST_DIR}/flat_surface.cc
    ${CMAKE_CURRENT_LIST_DIR}/frame_painter.cc
    ${CMAKE_CURRENT_LIST_DIR}/playback.cc
    ${CMAKE_CURRENT_LIST_DIR}/opening.cc
    ${CMAKE_CURRENT_LIST_DIR}/overlay.cc
    ${CMAKE_CURRENT_LIST_DIR}/panel.cc
    ${CMAKE_CURRENT_LIST_DIR}/panel_path.cc
    ${CMAKE_CURRENT_LIST_DIR}/panel_settings.cc
    ${CMAKE_CURRENT_LIST_DIR}/picture_texture.cc
    ${CMAKE_CURRENT_LIST_DIR}/strip_painter.cc
    ${CMAKE_CURRENT_LIST_DIR}/view_session.cc
    ${CMAKE_CURRENT_LIST_DIR}/viewer.cc
    ${CMAKE_CURRENT_LIST_DIR}/viewer_app.cc
    ${CMAKE_CURRENT_LIST_DIR}/viewer_arrivals.cc
    ${CMAKE_CURRENT_LIST_DIR}/viewer_input.cc
    ${CMAKE_CURRENT_LIST_DIR}/viewer_jobs.cc
    ${CMAKE_CURRENT_LIST_DIR}/viewer_path.cc
    ${CMAKE_CURRENT_LIST_DIR}/viewer_photos.cc
    ${CMAKE_CURRENT_LIST_DIR}/viewer_refine.cc
    ${CMAKE_CURRENT_LIST_DIR}/viewer_scale.cc
    ${CMAKE_CURRENT_LIST_DIR}/viewer_script.cc
    ${CMAKE_CURRENT_LIST_DIR}/viewer_show.cc
    ${CMAKE_CURRENT_LIST_DIR}/window.cc
  PUBLIC lumi_view_core lumi_render_gl
  PRIVATE glfw PkgConfig::IMGUI PkgConfig::EPOXY fmt::fmt Threads::Threads)

lumi_program(lumi-view ${CMAKE_CURRENT_LIST_DIR}/main.cc LIBS lumi_view lumi_program)
