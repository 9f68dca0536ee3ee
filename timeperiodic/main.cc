// lumi-timeperiodic: a scene that repeats itself, placed in space and time.
#include "scene/program/main_program.h"
#include "timeperiodic/calibrate.h"
#include "timeperiodic/commands.h"

namespace {

void AddSearch(lumi::Options& app, lumi::PeriodOptions& period, int& width_px) {
  app.Add("--min-period", period.min_period, "Shortest period sought, frames, >= 2").Default();
  app.Add("--max-period", period.max_period, "Longest period sought, frames; 0 = as the video's length allows")
      .Default();
  app.Add("--look-width", width_px, "Frames are looked at in this width, px, 16 to 4096").Range(16, 4096).Default();
}

}  // namespace

int main(int argc, char** argv) {
  lumi::Program program("lumi-timeperiodic",
                        "The period of a scene that repeats itself, and its video placed in space and time");
  program.options().RequireCommand();

  lumi::PeriodCommandOptions period;
  lumi::Options p =
      program.Command("period", "The period of a video from a tripod, or, with --moving, from a camera that moves",
                      [&] { return lumi::RunPeriod(period, program.progress()); });
  p.Add("VIDEO", period.video, "Video of some 10 to 20 periods").Required();
  p.Flag("--moving", period.moving, "The camera moves: what stands still is aligned first");
  p.Add("--frames", period.frames,
        "Two frames (from 0) that look alike, with --count periods between them, instead of a search")
      .Values(2);
  p.Add("--count", period.count, "Periods between --frames, >= 1");
  AddSearch(p, period.period, period.width_px);
  p.Add("--tradeoff", period.tradeoff,
        "Also the width that frames are looked at and their number against the period's error and seconds: table, and "
        "period.json, .csv, .svg in this folder");
  p.Add("--true-period", period.true_period_frames, "With --tradeoff: the period, frames, > 0, where it is known")
      .Positive();
  p.Add("--plot", period.plot, "SVG of the video's likeness to itself and of the periods considered");

  lumi::CalibrateVideoOptions calibrate;
  lumi::Options c = program.Command("calibrate",
                                    "A moving video becomes a scene with times and a period: what moves is masked, all "
                                    "frames get cameras (lumi-reconstruct)",
                                    [&] {
                                      calibrate.threads = program.threads();
                                      calibrate.seed = program.seed();
                                      return lumi::CalibrateVideo(calibrate, program.progress());
                                    });
  c.Add("VIDEO", calibrate.video, "Video of a moving camera").Required();
  c.Add("-o,--output", calibrate.scene, "Scene folder to write").Required();
  c.Add("--fixed-video", calibrate.fixed_video, "Video of the same scene from a tripod, for the period");
  c.Add("--period-frames", calibrate.period_frames, "The period, frames of VIDEO, > 0, where it is known");
  c.Add("--masks", calibrate.masks, "Masks given instead of found: frame_000000.jpg.png ..., black = moves");
  c.Flag("--masks-only", calibrate.masks_only,
         "Stop when the masks are written to SCENE/timeperiodic/masks, to edit them");
  AddSearch(c, calibrate.period, calibrate.width_px);
  c.Flag("--tradeoff", calibrate.tradeoff,
         "Also the width that frames are looked at and their number against the period's error (--period-frames is the "
         "truth), held-out error and seconds: table, and period.json, .csv, .svg in SCENE/tradeoff");
  c.Add("--max-moving", calibrate.max_moving_share, "Share of the picture that may move, 0 to 1; more is refused")
      .Range(0.0, 1.0)
      .Default();
  c.Group("Cameras");
  const auto pass = [&](const std::string& name, const std::string& help) {
    c.Pass(name, calibrate.reconstruct_arguments, help + " (as lumi-reconstruct)");
  };
  pass("--backend", "What finds the cameras");
  pass("--camera", "Known intrinsics, camera.yaml");
  pass("--focal-px", "Focal length, pixels");
  pass("--intrinsics", "fx,fy,cx,cy, pixels");
  pass("--refine", "factorization: intrinsics that the last adjustment may move");
  pass("--quality", "auto, low, medium or high");
  pass("--matching", "auto, exhaustive, similar or sequential");
  pass("--partners", "similar: frames that each is matched with first");
  pass("--mapper", "quick, careful or hierarchical");
  pass("--keyframes", "0 = by parallax");
  pass("--min-registered", "Fail unless this fraction of the frames gets a camera");

  std::string scene, plot;
  lumi::Options s = program.Command("sampling", "How well a scene's photos cover space and time",
                                    [&] { return lumi::ReportSceneSampling(scene, plot, program.progress()); });
  s.Add("SCENE", scene, "Scene with times and a period").Required();
  s.Add("--plot", plot, "SVG: position against time, folded into one period, and one window");

  program.options().Examples(
      "lumi-timeperiodic period tripod.mp4                           the period of what repeats itself\n"
      "lumi-timeperiodic calibrate moving.mp4 -o scene --fixed-video tripod.mp4");
  program.RunAndExit(argc, argv);
}
