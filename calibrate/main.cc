// lumi-calibrate: a camera's intrinsics from photos or a video of a checkerboard.
#include "calibrate/calibrate.h"
#include "scene/program/main_program.h"

int main(int argc, char** argv) {
  lumi::Program program("lumi-calibrate", "Calibrates a camera from photos or a video of a checkerboard");
  lumi::Options& app = program.options();
  lumi::CalibrateOptions options;
  app.Add("INPUT", options.input, "Folder of photos, or a video").Required();
  app.Add("--board", options.board, "Inner corners of the board, columns x rows").Default();
  app.Add("--square-mm", options.square_mm, "Side of a square in mm, > 0").Default();
  app.Add("-o,--output", options.output, "OpenCV/ROS camera file, .yaml").Default();
  app.Add("--report", options.report, "The report's file [default: report.html beside the output]");
  app.Add("--undistort", options.undistort,
          "Write the photos as a pinhole camera without skew would have taken them into this folder");
  app.Add("--model", options.fit.model,
          "thesis (= skew-k1k2), or PIXELS-DISTORTION of square, rect, skew and none, k1, k1k2, k1k2p, k1k2k3, k1k2pk3 "
          "[default: chosen by cross-validation]");
  app.Flag("--fix-aspect", options.fit.fix_aspect, "Square pixels: fy = fx");
  app.Flag("--keep-outliers", options.fit.keep_outliers,
           "Plain least squares over all views and corners, as OpenCV's calibrateCamera has it");
  app.Add("--corner-window", options.gather.corner_window_px,
          "Half the window a corner is refined in, in pixels, 1 to 50 [default: 0.4 of the distance to the next "
          "corner, up to 11]")
      .Range(1, 50);
  app.Add("--folds", options.fit.folds, "Folds of the cross-validation, >= 2").Default();
  app.Add("--min-coverage", options.fit.min_coverage, "Share of the picture that the corners have to cover, 0 to 1")
      .Default();
  app.Add("--max-focal-sigma", options.fit.max_focal_sigma,
          "Relative standard deviation of the focal length that is still answered, > 0")
      .Default();
  app.Add("--max-frames", options.gather.max_frames, "So many frames of a video are used, 3 to 1000")
      .Range(3, 1000)
      .Default();
  app.Add("--candidates", options.gather.video_candidates,
          "So many frames of a video are searched for the board, 3 to 100000")
      .Range(3, 100000)
      .Default();
  app.Flag("--tradeoff", options.tradeoff,
           "Also error, standard deviation and seconds against the number of views: table, JSON and SVG");
  app.Examples(
      "lumi-calibrate boards --board 9x6 --square-mm 25 -o camera.yaml\n"
      "lumi-reconstruct photos -o scene --camera camera.yaml");
  program.RunAndExit(argc, argv, [&] {
    options.seed = program.seed();
    return lumi::Calibrate(options, program.progress());
  });
}
