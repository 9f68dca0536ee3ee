# Tests of the OpenGL backend and of the viewer. Included by tests/render/CMakeLists.txt.
lumi_test(gl_renderer_test SOURCES ${CMAKE_CURRENT_LIST_DIR}/gl_hole_fill_test.cc ${CMAKE_CURRENT_LIST_DIR}/gl_photos_on_demand_test.cc ${CMAKE_CURRENT_LIST_DIR}/gl_renderer_test.cc
  LIBS lumi_render_gl lumi_render lumi_scene PkgConfig::EPOXY SECONDS 20)
lumi_test(gl_weights_test SOURCES ${CMAKE_CURRENT_LIST_DIR}/gl_weights_test.cc ${CMAKE_CURRENT_LIST_DIR}/gl_every_measure_test.cc
  LIBS lumi_render_gl lumi_render lumi_scene SECONDS 20)
lumi_test(gl_sparse_test SOURCES ${CMAKE_CURRENT_LIST_DIR}/gl_sparse_test.cc
  LIBS lumi_render_gl lumi_render lumi_scene SECONDS 10)
lumi_test(gl_hard_case_test SOURCES ${CMAKE_CURRENT_LIST_DIR}/gl_hard_case_test.cc ${CMAKE_CURRENT_LIST_DIR}/gl_hard_case_weights_test.cc
  LIBS lumi_render_gl lumi_render lumi_scene
  LABELS hard-case SECONDS 35)
if(LUMI_VIEWER)
  lumi_test(viewer_core_test SOURCES ${CMAKE_CURRENT_LIST_DIR}/viewer_core_test.cc ${CMAKE_CURRENT_LIST_DIR}/viewer_navigation_test.cc ${CMAKE_CURRENT_LIST_DIR}/viewer_settings_test.cc
    LIBS lumi_view_core lumi_render lumi_scene nlohmann_json::nlohmann_json)
  lumi_test(viewer_window_test SOURCES ${CMAKE_CURRENT_LIST_DIR}/viewer_window_test.cc ${CMAKE_CURRENT_LIST_DIR}/viewer_window_rest_test.cc
    LIBS lumi_view_core lumi_render lumi_scene nlohmann_json::nlohmann_json SECONDS 45)
  add_dependencies(viewer_window_test lumi-view lumi-export)
  set_tests_properties(viewer_window_test PROPERTIES ENVIRONMENT GALLIVM_PERF=nopt)
endif()
# On llvmpipe most of these tests' time went into optimising shaders that are run once on small pictures.
set_tests_properties(gl_renderer_test gl_weights_test gl_sparse_test gl_hard_case_test PROPERTIES ENVIRONMENT GALLIVM_PERF=nopt)
