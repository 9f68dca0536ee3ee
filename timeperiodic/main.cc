// lumi-timeperiodic: a scene that repeats itself, placed in space and time.
#include <nlohmann/json.hpp>

#include "scene/program/main_program.h"
#include "timeperiodic/calibrate.h"
#include "timeperiodic/commands.h"

namespace {

void AddSearch(CLI::App& app, lumi::PeriodOptions& period, int& width_px) {
  app.add_option("--min-period", period.min_period, "Shortest period sought, frames, >= 2")->capture_default_str();
  app.add_option("--max-period", period.max_period, "Longest period sought, frames; 0 = as the video's length allows")
      ->capture_default_str();
  app.add_option("--look-width", width_px, "Frames are looked at in this width, px, 16 to 4096")
      ->check(CLI::Range(16, 4096))
      ->capture_default_str();
}

}  // namespace

int main(int argc, char** argv) {
  lumi::Program program("lumi-timeperiodic", "The period of a scene that repeats itself, and its video placed in space and time");
  program.app().require_subcommand(1);

  lumi::PeriodCommandOptions period;
  CLI::App* p = program.app().add_subcommand("period", "The period of a video from a tripod, or, with --moving, from a camera that moves");
  p->add_option("VIDEO", period.video, "Video of some 10 to 20 periods")->required();
  p->add_flag("--moving", period.moving, "The camera moves: what stands still is aligned first");
  p->add_option("--frames", period.frames, "Two frames (from 0) that look alike, with --count periods between them, instead of a search")
      ->expected(2);
  p->add_option("--count", period.count, "Periods between --frames, >= 1");
  AddSearch(*p, period.period, period.width_px);
  p->add_option("--tradeoff", period.tradeoff, "Also the width that frames are looked at and their number against the period's error and seconds: table, and period.json, .csv, .svg in this folder");
  p->add_option_function<double>("--true-period", [&](const double& t) { period.true_period_frames = t; }, "With --tradeoff: the period, frames, > 0, where it is known")
      ->check(CLI::PositiveNumber);
  p->add_option("--plot", period.plot, "SVG of the video's likeness to itself and of the periods considered");

  lumi::CalibrateVideoOptions calibrate;
  CLI::App* c = program.app().add_subcommand(
      "calibrate",
      "A moving video becomes a scene with times and a period: what moves is masked, all frames get cameras (lumi-reconstruct)");
  c->add_option("VIDEO", calibrate.video, "Video of a moving camera")->required();
  c->add_option("-o,--output", calibrate.scene, "Scene folder to write")->required();
  c->add_option("--fixed-video", calibrate.fixed_video, "Video of the same scene from a tripod, for the period");
  c->add_option_function<double>(
      "--period-frames", [&](const double& t) { calibrate.period_frames = t; }, "The period, frames of VIDEO, > 0, where it is known");
  c->add_option("--masks", calibrate.masks, "Masks given instead of found: frame_000000.jpg.png ..., black = moves");
  c->add_flag("--masks-only", calibrate.masks_only, "Stop when the masks are written to SCENE/timeperiodic/masks, to edit them");
  AddSearch(*c, calibrate.period, calibrate.width_px);
  c->add_flag("--tradeoff", calibrate.tradeoff, "Also the width that frames are looked at and their number against the period's error (--period-frames is the truth), held-out error and seconds: table, and period.json, .csv, .svg in SCENE/tradeoff");
  c->add_option("--max-moving", calibrate.max_moving_share, "Share of the picture that may move, 0 to 1; more is refused")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  const auto pass = [&](const std::string& name, const std::string& help) {
    c->add_option_function<std::string>(
         name,
         [&calibrate, name](const std::string& value) {
           calibrate.reconstruct_arguments.insert(calibrate.reconstruct_arguments.end(), {name, value});
         },
         help + " (as lumi-reconstruct)")
        ->group("Cameras");
  };
  pass("--backend", "What finds the cameras");
  pass("--camera", "Known intrinsics, camera.yaml");
  pass("--focal-px", "Focal length, pixels");
  pass("--intrinsics", "fx,fy,cx,cy, pixels");
  pass("--refine", "factorization: intrinsics that the last adjustment may move");
  pass("--quality", "auto, low, medium or high");
  pass("--matching", "auto, exhaustive or sequential");
  pass("--keyframes", "0 = by parallax");
  pass("--min-registered", "Fail unless this fraction of the frames gets a camera");

  std::string scene, plot;
  CLI::App* s = program.app().add_subcommand("sampling", "How well a scene's photos cover space and time");
  s->add_option("SCENE", scene, "Scene with times and a period")->required();
  s->add_option("--plot", plot, "SVG: position against time, folded into one period, and one window");

  return program.Run(
      argc, argv,
      [&] {
        if (p->parsed()) return lumi::RunPeriod(period, program.progress());
        if (s->parsed()) return lumi::ReportSceneSampling(scene, plot, program.progress());
        calibrate.threads = program.threads();
        calibrate.seed = program.seed();
        return lumi::CalibrateVideo(calibrate, program.progress());
      },
      [&](const std::string& json) -> std::string {
        if (p->parsed()) return lumi::DescribePeriod(json);
        if (s->parsed()) return nlohmann::json::parse(json).dump(1);
        return lumi::DescribeCalibratedVideo(json);
      });
}
