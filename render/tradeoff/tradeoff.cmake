# Accuracy against time. Included by render/CMakeLists.txt after gl.cmake.
lumi_library(lumi_render_tradeoff COLD
  SOURCES
    ${CMAKE_CURRENT_LIST_DIR}/ablation.cc
    ${CMAKE_CURRENT_LIST_DIR}/budget.cc
    ${CMAKE_CURRENT_LIST_DIR}/fidelity.cc
    ${CMAKE_CURRENT_LIST_DIR}/frame_error.cc
    ${CMAKE_CURRENT_LIST_DIR}/front.cc
    ${CMAKE_CURRENT_LIST_DIR}/measure.cc
    ${CMAKE_CURRENT_LIST_DIR}/methods.cc
    ${CMAKE_CURRENT_LIST_DIR}/methods_report.cc
    ${CMAKE_CURRENT_LIST_DIR}/properties.cc
    ${CMAKE_CURRENT_LIST_DIR}/ray_bench.cc
    ${CMAKE_CURRENT_LIST_DIR}/ray_figures.cc
    ${CMAKE_CURRENT_LIST_DIR}/sweep.cc
    ${CMAKE_CURRENT_LIST_DIR}/table_3_1.cc
    ${CMAKE_CURRENT_LIST_DIR}/time_windows.cc
    ${CMAKE_CURRENT_LIST_DIR}/tradeoff.cc
    ${CMAKE_CURRENT_LIST_DIR}/workbench.cc
  PUBLIC lumi_render lumi_scene lumi_tradeoff
  PRIVATE lumi_render_gl fmt::fmt)
