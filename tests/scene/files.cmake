lumi_test(test_scene_files
  SOURCES
    files_atomic_file_test.cc
    files_camera_yaml_test.cc
    files_colmap_model_test.cc
    files_fuzz_test.cc
    files_image_io_test.cc
    files_mesh_io_test.cc
    files_picture_info_test.cc
    files_provenance_test.cc
    projective_json_test.cc
    files_scene_folder_test.cc
    files_transforms_json_test.cc
    files_undistort_test.cc
    files_video_clock_test.cc
    files_video_colours_test.cc
    files_video_interlaced_test.cc
    files_video_test.cc
    files_video_times_test.cc
  LIBS lumi_scene nlohmann_json::nlohmann_json fmt::fmt OpenImageIO::OpenImageIO PkgConfig::LCMS opencv_core)
get_target_property(lcms_options PkgConfig::LCMS INTERFACE_COMPILE_OPTIONS)
if("-pthread" IN_LIST lcms_options)
  # Since Debian 13; no compiler takes a precompiled header that was made without.
  set_target_properties(test_scene_files PROPERTIES DISABLE_PRECOMPILE_HEADERS ON)
endif()
