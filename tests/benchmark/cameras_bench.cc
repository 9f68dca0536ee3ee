// Cameras by features and matches of ours, and COLMAP's mapper as we call it, beside COLMAP's own extraction, matching
// and mapping with its own bounds, of photos of one size: seconds a step, photos placed, errors where the truth is
// known, and cameras far off that nothing names. Scenes lie in WORK/cameras; what is there already is taken, times and
// all.
//
//   cameras_bench --work build/bench --data DIR [--only fox] [--seeds 3] [--keep-colmap]
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>

#include "reconstruct/options.h"
#include "scene/files/atomic_file.h"
#include "scene/files/scene_folder.h"
#include "scene/geometry/median.h"
#include "scene/program/main_program.h"
#include "scene/program/sibling.h"
#include "tests/benchmark/captures.h"
#include "tests/benchmark/figures.h"
#include "tests/benchmark/truth.h"

namespace lumi {
namespace {
namespace fs = std::filesystem;

struct CameraRun {
  int total = 0, placed = 0;
  std::map<std::string, StepTime> steps;
  double reprojection_px = 0;
  std::optional<PoseErrors> errors;
  std::size_t unnamed = 0;
};

struct BenchOptions {
  fs::path data, work = "build/bench";
  std::vector<std::string> only;
  std::vector<std::string> more;  // for lumi-reconstruct
  int seeds = 3;
};

CameraRun Measure(const BenchCapture& capture, const std::string& name, const std::string& features, int seed,
                  const BenchOptions& options, ProgressSink& progress) {
  const fs::path scene = options.work / "cameras" / fmt::format("{}-{}-{}", name, features, seed);
  const fs::path answer = scene.string() + ".json";
  if (!fs::exists(answer)) {
    std::vector<std::string> arguments{capture.photos.string(),
                                       "-o",
                                       scene.string(),
                                       "--features",
                                       features,
                                       "--seed",
                                       std::to_string(seed),
                                       "--poses",
                                       "none",
                                       "--mapper",
                                       features == "own" ? "quick" : "careful"};
    arguments.insert(arguments.end(), options.more.begin(), options.more.end());
    fs::remove_all(scene);
    const SiblingAnswer run = RunSibling({"lumi-reconstruct", arguments, name + ": ", name + ": "}, progress);
    WriteTextAtomically(answer, run.summary.Text(1));
  }
  const auto summary = JsonKeys::Parse(ReadText(answer)).value().As<ReconstructSummary>();
  CameraRun measured;
  measured.total = summary.images_total;
  measured.placed = summary.images_registered;
  measured.reprojection_px = summary.mean_reprojection_error_px;
  for (const StepTime& step : summary.steps) measured.steps[step.name] = step;
  OpenOptions as_they_are;
  as_they_are.check_photos = false;
  as_they_are.undistort = false;
  if (capture.truth.empty()) return measured;
  const Scene made = OpenScene(scene, as_they_are, progress);
  const TruePoses truth = ReadTruePoses(capture.truth);
  measured.errors = CompareWithTruth(made, truth);
  measured.unnamed = FarOffUnnamed(made, truth, summary);
  return measured;
}

// Medians over the runs; photos: the fewest.
template <typename Get>
double MedianOf(const std::vector<CameraRun>& runs, const Get& get) {
  std::vector<double> values;
  for (const CameraRun& run : runs) values.push_back(get(run));
  return Median(std::move(values));
}

double StepSeconds(const std::vector<CameraRun>& runs, const std::string& step, bool cpu) {
  return MedianOf(runs, [&](const CameraRun& run) {
    const auto it = run.steps.find(step);
    return it == run.steps.end() ? 0.0 : cpu ? it->second.cpu_seconds : it->second.seconds;
  });
}

std::string Row(const std::string& name, const std::string& features, const std::vector<CameraRun>& runs) {
  std::string row = fmt::format("| {} | {} |", name, features == "own" ? "ours, quick" : "COLMAP's, careful");
  for (const bool cpu : {false, true})
    for (const char* step : {"features", "matching", "mapping", "polishing"})
      row += fmt::format(" {:.1f} |", StepSeconds(runs, step, cpu));
  int placed = runs.front().placed;
  for (const CameraRun& run : runs) placed = std::min(placed, run.placed);
  row += fmt::format(" {} of {} | {:.3f} |", placed, runs.front().total,
                     MedianOf(runs, [](const CameraRun& r) { return r.reprojection_px; }));
  if (!runs.front().errors) return row + " | | |";
  std::size_t unnamed = 0;
  for (const CameraRun& run : runs) unnamed = std::max(unnamed, run.unnamed);
  return row +
         fmt::format(" {:.4f} | {:.4f} | {} |",
                     MedianOf(runs, [](const CameraRun& r) { return r.errors ? r.errors->centre_rms_percent : 1e9; }),
                     MedianOf(runs, [](const CameraRun& r) { return r.errors ? r.errors->rotation_rms_deg : 1e9; }),
                     unnamed);
}

std::string MeasureAll(const BenchOptions& options, ProgressSink& progress) {
  const fs::path desk = options.work / "desk-capture";
  SimulateDesk(desk, progress);
  std::vector<BenchCapture> captures = BenchCaptures(options.data, desk);
  if (fs::is_directory(options.data / "dinosaur" / "images"))
    captures.push_back({"dinosaur", options.data / "dinosaur" / "images", {}});
  fs::create_directories(options.work / "cameras");
  std::string table =
      "| capture | features by, mapper | features s | matching s | mapping s | polishing s | CPU: features s | "
      "matching s | "
      "mapping s | polishing s | photos placed | reprojection px | centres rms % | rotations rms deg | ten times "
      "the median off, not named |\n"
      "|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n";
  std::string ratios =
      "\nOurs, polishing included, over COLMAP's extraction, matching and mapping:\n\n| capture | seconds | CPU "
      "seconds "
      "|\n|---|---|---|\n";
  for (const BenchCapture& capture : captures) {
    const std::string name = capture.name.substr(0, capture.name.find(' '));
    if (!options.only.empty() && std::find(options.only.begin(), options.only.end(), name) == options.only.end())
      continue;
    std::map<std::string, std::vector<CameraRun>> runs;
    // Turn by turn: what else the machine does meets both.
    for (int seed = 0; seed < options.seeds; ++seed)
      for (const char* features : {"own", "colmap"})
        runs[features].push_back(Measure(capture, name, features, seed, options, progress));
    for (const char* features : {"colmap", "own"}) table += Row(name, features, runs[features]) + "\n";
    ratios += fmt::format("| {} |", name);
    for (const bool cpu : {false, true}) {
      double ours = 0, theirs = 0;
      for (const char* step : {"features", "matching", "mapping", "polishing"})
        ours += StepSeconds(runs["own"], step, cpu);
      for (const char* step : {"features", "matching", "mapping"}) theirs += StepSeconds(runs["colmap"], step, cpu);
      ratios += fmt::format(" {:.2f} |", ours / theirs);
    }
    ratios += "\n";
  }
  return table + ratios;
}

}  // namespace
}  // namespace lumi

int main(int argc, char** argv) {
  lumi::Program program("cameras_bench", "Seconds and errors of cameras by our features and by COLMAP's");
  lumi::BenchOptions o;
  lumi::Options options = program.options();
  options.Add("--data", o.data, "Folder of captures: fountain, sceaux, fox, dinosaur");
  options.Add("--work", o.work, "Where scenes are kept; a second run reuses them").Default();
  options.Add("--only", o.only, "Captures by name (desk, fountain ...); default: all");
  options.Add("--more", o.more, "Options for lumi-reconstruct").Commas();
  options.Add("--seeds", o.seeds, "Runs of each, with seeds 0, 1 ...").Range(1, 100).Default();
  program.RunAndExit(argc, argv, [&] {
    const std::string text = lumi::MeasureAll(o, program.progress());
    return lumi::Answer(lumi::JsonKeys(), text);
  });
}
