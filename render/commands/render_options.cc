#include "render/commands/render_options.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <string_view>

#include "render/comparators/comparators.h"
#include "render/holdout/holdout.h"
#include "render/radiance/setting_options.h"
#include "render/tradeoff/sweep.h"
#include "scene/files/image_io.h"
#include "scene/files/video.h"
#include "scene/program/error.h"
#include "scene/program/whole_number.h"

namespace lumi {
namespace {

std::vector<std::string_view> HeatMapNames() {
  std::vector<std::string_view> names;
  for (const HeatMap& map : HeatMaps()) names.push_back(map.name);
  return names;
}

void RequireFidelityAlone(const RenderOptions& o) {
  if (!o.fidelity_db) return;
  if (!(*o.fidelity_db > 0 && std::isfinite(*o.fidelity_db))) throw UsageError("--fidelity-db must be above 0");
  if (!o.along_path()) throw UsageError("--fidelity-db is of a path's frames, not of --view or --holdout");
  if (o.budget_ms) throw UsageError("--fidelity-db and --budget-ms do not go together: both choose the settings");
  if (o.show != "color") throw UsageError("--fidelity-db compares colours: --show does not go with it");
  for (const char* name : {"grid", "sampling"})
    if (o.decided.Has(name)) throw UsageError(std::string("--fidelity-db chooses --") + name + ": give one of them");
  if (o.settings.similarity == Similarity::kFull)
    throw UsageError(
        "--fidelity-db is held against the identity at every pixel: --similarity full does not go with it");
}

constexpr std::array kOwnWeightsOptions =
    std::to_array<std::string_view>({"k", "correlation", "sampling", "epipoles", "sum", "combine", "cutoff-deg",
                                     "accuracy", "r-min-deg", "r-max-deg", "noise", "alpha"});

// A published method has weights at every pixel on the CPU; options that only this renderer's weights know are refused.
void RequirePublished(const RenderOptions& o) {
  if (const std::string problem = ProblemOf(o.settings); !problem.empty()) throw UsageError(problem);
  if (o.settings.method == Algorithm::kUlr) return;
  const auto refuse = [&](const std::string& what) {
    throw UsageError(fmt::format("{} does not go with --method {}", what, Name(o.settings.method)));
  };
  if (o.settings.correlation == Correlation::kMeasured) refuse("--correlation measured");
  if (o.budget_ms) refuse("--budget-ms");
  if (o.fidelity_db) refuse("--fidelity-db");
  if (MeasureFromName(o.show) || o.show == "tessellation") refuse("--show " + o.show);
  // Published methods have their own word on resolution.
  if (("," + o.effects + ",").find(",resolution,") != std::string::npos) refuse("--effects resolution");
  // Options that only this renderer's own weights read. A settings file names all of them, so default values are
  // accepted.
  const RadianceSettings usual;
  for (const SettingOption& option : SettingOptions())
    if (std::ranges::find(kOwnWeightsOptions, option.name) != kOwnWeightsOptions.end() && o.decided.Has(option.name) &&
        option.get(o.settings) != option.get(usual))
      refuse("--" + option.name);
}

// A part of a path's frames.
void RequirePart(const RenderOptions& o) {
  if (!o.part_of_path()) return;
  if (o.frames && o.shard) throw UsageError("--frames and --shard do not go together: both say which frames");
  const char* option = o.frames ? "--frames" : "--shard";
  if (!o.along_path()) throw UsageError(fmt::format("{} is of a path, not of --view or --holdout", option));
  if (o.to_video() || o.video)
    throw UsageError(fmt::format("{} writes some of a path's frames, and a film has all", option),
                     "write the film by a run without it: it takes the frames that are there");
  if (o.budget_ms || o.fidelity_db)
    throw UsageError(fmt::format("{} chooses settings on each machine anew, and parts of one path have the same: {} "
                                 "does not go with it",
                                 o.budget_ms ? "--budget-ms" : "--fidelity-db", option),
                     "give the settings that it chose: --settings FILE");
}

void RequireTogether(const RenderOptions& o) {
  if (const std::string problem = Validate(o.settings); !problem.empty()) throw UsageError(problem);
  RequirePublished(o);
  if (o.backend == "gl" && (!o.budget_ms || o.decided.Has("grid"))) RequireDrawnByGl(o.settings);
  if (o.budget_ms && !(*o.budget_ms > 0 && std::isfinite(*o.budget_ms)))
    throw UsageError("--budget-ms must be above 0");
  RequireFidelityAlone(o);
  RequirePart(o);
  if (o.holdout != 0 && o.holdout != kHoldoutEach && o.holdout != kHoldoutAuto && o.holdout < 2)
    throw UsageError("--holdout takes 2 or more, each, or auto");
  if (o.holdout != 0 && !o.view.empty()) throw UsageError("--holdout and --view do not go together");
  if (!o.path.empty() && (o.holdout != 0 || !o.view.empty()))
    throw UsageError("--path goes with neither --holdout nor --view");
  if (o.show == "cameras" && o.view.empty() && o.path.empty())
    throw UsageError("--show cameras needs --view or --path: the virtual view that is drawn among them");
  if (!o.of.empty() && !MeasureFromName(o.show))
    throw UsageError(fmt::format("--of goes with --show {}", fmt::join(HeatMapNames(), ", ")));
  if (o.holdout != 0 && o.show != "color") throw UsageError("--holdout compares colours: --show does not go with it");
  if (o.holdout != 0 && o.border.fill)
    throw UsageError("--holdout never judges filled holes: --border fill does not go with it");
  if (o.show == "difference" && o.view.empty())
    throw UsageError("--show difference needs --view: the photo to compare with");
}

void RequireNothingIgnored(const RenderOptions& o) {
  const auto given = [&](const char* name) { return o.decided.Has(name); };
  if (o.phase && !std::isfinite(*o.phase)) throw UsageError("--phase must be a number");
  if (o.settings.Sparse() && !o.budget_ms && !HasSamples(o.settings))
    throw UsageError("--grid with --k all needs --sampling interpolated: all photos are candidates at every pixel");
  if (o.show == "tessellation" && !o.budget_ms && !HasSamples(o.settings))
    throw UsageError("--show tessellation needs --grid: there are no sparse samples to show");
  if (o.holdout != 0 && o.height_px > 0) throw UsageError("--holdout keeps the photos' aspect: --width, not --height");
  if (o.holdout != 0 && given("format")) throw UsageError("--holdout writes JPEG: --format does not go with it");
  if (o.holdout == 0 && given("fold")) throw UsageError("--fold goes with --holdout");
  if (o.holdout == kHoldoutAuto && given("fold"))
    throw UsageError("--fold goes with --holdout N: auto may leave out each photo in turn, which has no folds");
  if (o.holdout == kHoldoutEach && given("fold"))
    throw UsageError("--fold goes with --holdout N: each photo is left out in turn, and there are no folds");
  if (o.holdout == 0 && !o.seen_proxy.empty()) throw UsageError("--seen-proxy goes with --holdout");
  if (o.video && !o.along_path()) throw UsageError("--video shows a path, not --view or --holdout");
  if (given("seconds") && (!o.path.empty() || !o.along_path()))
    throw UsageError("--seconds is of the path through the photos: neither --path, --view nor --holdout goes with it");
  if (given("fps") && !o.along_path())
    throw UsageError("--fps is of a path: neither --view nor --holdout goes with it");
  if (given("fps") && !o.path.empty() && !o.video && !o.to_video())
    throw UsageError("--fps with --path is of the film: --video or -o FILE.mp4 writes one");
  if (given("format") && o.to_video()) throw UsageError("--format is of pictures: -o names a video");
  if (o.format == "exr" && !o.view.empty() && (o.show == "cameras" || o.show == "difference"))
    throw UsageError("--show " + o.show + " is drawn in 8 bits: --format png or jpg");
  if (given("fill-frames") && !o.border.fill) throw UsageError("--fill-frames goes with --border fill");
  if (!o.pixels.empty() && o.view.empty()) throw UsageError("--pixel goes with --view: it is of one picture");
  if (o.leave_out && o.view.empty()) throw UsageError("--leave-out goes with --view");
  if (o.width_px < 0 || o.height_px < 0 || o.width_px > kMaxPictureSide || o.height_px > kMaxPictureSide)
    throw UsageError("--width and --height take 1 to " + std::to_string(kMaxPictureSide));
  if (!(o.seconds > 0 && o.seconds <= 3600) || !(o.fps > 0 && o.fps <= 240))
    throw UsageError("--seconds takes up to 3600, --fps up to 240");
}

}  // namespace

FrameRange FrameRangeFrom(const std::string& text) {
  const std::size_t dash = text.find('-');
  const auto first = WholeNumber(std::string_view(text).substr(0, dash));
  const auto last = dash == std::string::npos ? first : WholeNumber(std::string_view(text).substr(dash + 1));
  if (!first || !last || *first > *last) throw UsageError("--frames takes A-B, frames from 0, as 0-99; not " + text);
  return {static_cast<std::size_t>(*first), static_cast<std::size_t>(*last)};
}

Eigen::Vector2d PixelFrom(const std::string& text) {
  const std::size_t comma = text.find(',');
  const auto number = [&](const std::string& word) {
    double value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (word.empty() || error != std::errc() || end != word.data() + word.size() || !std::isfinite(value))
      throw UsageError("--pixel takes X,Y, pixels from the upper left corner; not " + text);
    return value;
  };
  if (comma == std::string::npos) throw UsageError("--pixel takes X,Y, pixels from the upper left corner; not " + text);
  return {number(text.substr(0, comma)), number(text.substr(comma + 1))};
}

int HoldoutFrom(const std::string& text) {
  if (text == "each") return kHoldoutEach;
  if (text == "auto") return kHoldoutAuto;
  int n = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), n);
  if (error != std::errc() || end != text.data() + text.size() || n < 2)
    throw UsageError("takes a whole number N of 2 or more, each, or auto; not " + text);
  return n;
}

int HoldoutFor(int holdout, std::size_t photos) {
  if (holdout != kHoldoutAuto) return holdout;
  return photos < static_cast<std::size_t>(kFewestForFolds) ? kHoldoutEach : kUsualHoldout;
}

const std::vector<std::string>& ShowNames() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> n{"color", "false-color", "tessellation"};
    for (const std::string_view map : HeatMapNames()) n.emplace_back(map);
    for (const char* last : {"difference", "cameras", "proxy"}) n.emplace_back(last);
    return n;
  }();
  return names;
}

void RequireConsistent(const RenderOptions& o) {
  RequireTogether(o);
  RequireNothingIgnored(o);
  if (o.output.empty() && o.holdout == 0) throw UsageError("-o says where the pictures go");
  if (o.to_video() && !o.along_path()) throw UsageError("a video needs a path, not --view or --holdout");
  std::error_code ec;
  if (o.to_video()) return RequireOurFilm(o.output);
  if (std::filesystem::is_directory(o.output, ec)) return;
  const std::string name = o.output.filename().string(), stem = o.output.stem().string();
  if (HasVideoExtension(o.output))
    throw UsageError(fmt::format("-o {}: films are written as .mp4 (H.264)", name),
                     fmt::format("name it {}.mp4, or a folder for pictures", stem));
  if (HasImageExtension(o.output))
    throw UsageError(fmt::format("-o {}: it names the folder of the pictures, not a picture", name),
                     fmt::format("-o {} --format png, jpg or exr", stem));
}

}  // namespace lumi
