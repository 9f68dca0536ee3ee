// Cameras as a capture grows: photos of a simulated walk in shuffled order, so that names say nothing of what lies near
// what. Seconds a step, pairs tried, photos placed, errors, and the most memory that a program took.
//
//   walk_bench --work build/bench [--photos 50,100,200] [--example plaza] [--more --matching,exhaustive]
#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <numeric>
#include <random>

#include "reconstruct/colmap_database.h"
#include "reconstruct/options.h"
#include "scene/files/atomic_file.h"
#include "scene/files/scene_folder.h"
#include "scene/program/main_program.h"
#include "scene/program/sibling.h"
#include "simulate/examples.h"
#include "tests/benchmark/truth.h"

namespace lumi {
namespace {
namespace fs = std::filesystem;

struct WalkOptions {
  fs::path work = "build/bench";
  std::string example = "plaza", features = "own";
  int width = 640;
  std::vector<int> photos{50, 100, 200};
  std::vector<std::string> more;  // for lumi-reconstruct
};

// More photos than the example's path has views: it is walked there and back again, as somebody does who wants to have
// all of it, each time 1.2 m further off, turned a little more to one side or the other. Empty: the example has enough.
std::string LongerWalk(const std::string& example, int photos) {
  auto scene = nlohmann::json::parse(ExampleJson(example));
  const nlohmann::json path = scene["path"];
  const int views = path["views"];
  if (photos <= views) return "";
  constexpr int kViewsAtATime = 200;
  constexpr double kFurtherOff = 1.2, kTurned[] = {0, -0.35, 0.35};  // m, and tan of the angle
  const int times = (photos + kViewsAtATime - 1) / kViewsAtATime;
  scene["path"] = nlohmann::json::array();
  for (int i = 0; i < times; ++i) {
    nlohmann::json one = path;
    one["views"] = photos / times + (i < photos % times ? 1 : 0);
    one["fps"] = path["fps"].get<double>() * one["views"].get<int>() / views;  // as quick on foot
    if (i % 2 == 1) std::swap(one["from"], one["to"]);
    for (const char* end : {"from", "to"}) one[end][1] = one[end][1].get<double>() - kFurtherOff * i;
    one["direction"][0] = one["direction"][0].get<double>() + kTurned[i % 3];
    scene["path"].push_back(one);
  }
  return scene.dump(2);
}

// The walk's photos under names that a random order gives them; the same for the truth.
TruePoses Shuffle(const fs::path& capture, const fs::path& shuffled) {
  std::vector<fs::path> photos;
  for (const auto& entry : fs::directory_iterator(capture / "images")) photos.push_back(entry.path());
  std::ranges::sort(photos);
  std::vector<std::size_t> order(photos.size());
  std::iota(order.begin(), order.end(), 0);
  std::mt19937 random(7);
  std::ranges::shuffle(order, random);
  const TruePoses truth = ReadTruePoses(capture / "truth");
  TruePoses renamed;
  fs::remove_all(shuffled);
  fs::create_directories(shuffled);
  for (std::size_t i = 0; i < photos.size(); ++i) {
    const std::string name = fmt::format("{:05}", i);
    const fs::path& photo = photos[order[i]];
    fs::create_hard_link(photo, shuffled / (name + photo.extension().string()));
    renamed[name] = truth.at(photo.stem().string());
  }
  return renamed;
}

std::string Row(int photos, const WalkOptions& options, ProgressSink& progress) {
  const fs::path capture = options.work / fmt::format("walk-{}-{}-{}", options.example, photos, options.width);
  const fs::path scene = capture.string() + "-scene", shuffled = capture.string() + "-shuffled";
  std::vector<std::string> simulated{"--example", options.example, "--views", std::to_string(photos)};
  if (const std::string longer = LongerWalk(options.example, photos); !longer.empty()) {
    const fs::path description = capture.string() + ".json";
    WriteTextAtomically(description, longer);
    simulated = {description.string()};
  }
  simulated.insert(simulated.end(), {"--width", std::to_string(options.width), "-o", capture.string()});
  RunSibling({"lumi-simulate", simulated, "", ""}, progress);
  const TruePoses truth = Shuffle(capture, shuffled);
  fs::remove_all(scene);
  std::vector<std::string> arguments{shuffled.string(), "-o", scene.string(), "--features", options.features};
  arguments.insert(arguments.end(), options.more.begin(), options.more.end());
  const SiblingAnswer run = RunSibling({"lumi-reconstruct", arguments, "", ""}, progress);
  const auto summary = run.summary.As<ReconstructSummary>();
  const auto seconds = [&](const char* step) {
    double sum = 0;
    for (const StepTime& s : summary.steps)
      if (s.name == step) sum += s.seconds;
    return sum;
  };
  rusage children{};
  getrusage(RUSAGE_CHILDREN, &children);
  OpenOptions as_they_are;
  as_they_are.check_photos = false;
  as_they_are.undistort = false;
  const Scene made = OpenScene(scene, as_they_are, progress);
  const auto errors = CompareWithTruth(made, truth);
  const std::size_t pairs = ColmapDatabase(scene / "colmap" / "database.db").MatchedPairs().size();
  return fmt::format("| {} | {} | {} | {:.1f} | {:.1f} | {:.1f} | {:.1f} | {:.1f} | {} | {} | {} | {} |\n",
                     options.example, photos, pairs, seconds("features"), seconds("matching"), seconds("mapping"),
                     seconds("polishing"), run.seconds, summary.images_registered,
                     errors
                         ? fmt::format("{:.4f} | {:.4f} | {:.4f} | {:.4f}", errors->centre_rms_percent,
                                       errors->centre_max_percent, errors->rotation_rms_deg, errors->rotation_max_deg)
                         : " | | | ",
                     FarOffUnnamed(made, truth, summary), children.ru_maxrss / 1024);
}

}  // namespace
}  // namespace lumi

int main(int argc, char** argv) {
  lumi::Program program("walk_bench", "Cameras of a simulated walk in shuffled order, as the number of photos grows");
  lumi::WalkOptions o;
  lumi::Options options = program.options();
  options.Add("--work", o.work, "Where captures and scenes are kept").Default();
  options.Add("--example", o.example, "Of lumi-simulate: a walk").Default();
  options.Add("--features", o.features, "own or colmap").Default();
  options.Add("--width", o.width, "Of the photos, px").Default();
  options.Add("--photos", o.photos, "Of each row, growing").Commas();
  options.Add("--more", o.more, "Options for lumi-reconstruct").Commas();
  program.RunAndExit(argc, argv, [&] {
    std::string text =
        "| walk | photos | pairs tried | features s | matching s | mapping s | polishing s | all s | placed | centres "
        "rms % | worst "
        "% "
        "| rotations rms deg | worst deg | ten times the median off, not named | MB of the largest program "
        "|\n|---|---|---|---|---|---|---|---|---|---|---|---|---|"
        "---|---|\n";
    for (const int photos : o.photos) text += lumi::Row(photos, o, program.progress());
    return lumi::Answer(lumi::JsonKeys(), text);
  });
}
