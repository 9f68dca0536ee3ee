#include "reconstruct/tradeoff.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <limits>
#include <map>

#include "reconstruct/cameras_beside.h"
#include "reconstruct/factorization/windows.h"
#include "reconstruct/features.h"
#include "reconstruct/reconstruct.h"
#include "scene/files/atomic_file.h"
#include "scene/files/colmap_model.h"
#include "scene/files/scene_folder.h"
#include "scene/files/temporary_folder.h"
#include "scene/program/error.h"
#include "scene/program/interrupt.h"
#include "scene/program/stopwatch.h"
#include "scene/tracks/match_photos.h"
#include "scene/tracks/track_video.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

constexpr std::size_t kLeastShared = 3;  // photos: fewer cannot be aligned
constexpr int kLeastFeatures = 50, kLeastWindow = 3, kLeastSidePx = 100;
// For more photos than the first, matching all pairs is not tried; the hierarchical mapper, whose parts have 100
// photos, is tried only for more than the second.
constexpr int kMostPhotosForAllPairs = 200, kPhotosForParts = 100;
constexpr double kLongerWindow = 1.25;     // a window that is longer by less is the same
constexpr double kAdjustmentEffort = 10;   // ranks any adjusted setting above the same without
constexpr double kLeastShownError = 1e-6;  // where the logarithmic axes end

// One setting that is varied.
struct Dial {
  const char* line;
  std::vector<int> values;  // ascending, `given` among them
  int given;
  std::function<void(ReconstructOptions&, int)> set;
  std::function<std::string(int)> text;
  std::function<double(int)> effort;
  bool has_ends = true;  // the cheapest and the dearest of its values stand in the settings of that name
};

std::vector<int> Around(int given, std::initializer_list<double> factors, int least, int most) {
  std::vector<int> values{given};
  for (const double factor : factors) {
    const int value = static_cast<int>(std::lround(std::min(factor * given, static_cast<double>(most))));
    if (value >= least && value != given) values.push_back(value);
  }
  std::ranges::sort(values);
  values.erase(std::unique(values.begin(), values.end()), values.end());
  return values;
}

double InProportion(int value) { return value; }

// The number of others that each photo is matched with at first; `all` means every pair.
Dial PairsDial(const ReconstructOptions& o, const ReconstructExtent& extent) {
  const int all = std::max(1, extent.photos - 1);
  const bool exhaustive = ChoosePairs(o, static_cast<std::size_t>(extent.photos), extent.is_video) == PairChoice::kAll;
  const int given = exhaustive ? all : std::min(all, PartnersOf(o, extent.is_video));
  std::vector<int> values{given};
  for (const int v : Around(exhaustive ? PartnersOf({}, extent.is_video) : given, {0.25, 0.5, 2}, 1, 2 * all))
    if (v < all) values.push_back(v);
  if (extent.photos <= kMostPhotosForAllPairs) values.push_back(all);
  std::ranges::sort(values);
  values.erase(std::unique(values.begin(), values.end()), values.end());
  return {"pairs",
          values,
          given,
          [all](ReconstructOptions& r, int v) {
            r.matching = v == all ? Matching::kExhaustive : Matching::kSimilar;
            r.partners = v == all ? 0 : v;
          },
          [all](int v) { return v == all ? "all pairs" : fmt::format("{} partners", v); },
          InProportion};
}

Dial MapperDial(const ReconstructOptions& o, const ReconstructExtent& extent) {
  constexpr int kHierarchical = static_cast<int>(Mapper::kHierarchical), kQuick = static_cast<int>(Mapper::kQuick);
  const int given = static_cast<int>(o.mapper);
  std::vector<int> values{kQuick, static_cast<int>(Mapper::kCareful)};
  if (extent.photos > kPhotosForParts || given == kHierarchical) values.insert(values.begin(), kHierarchical);
  return {"mapper",
          values,
          given,
          [](ReconstructOptions& r, int v) { r.mapper = static_cast<Mapper>(v); },
          [](int v) { return Name(static_cast<Mapper>(v)) + " mapper"; },
          [](int v) { return 1.0 + v; }};
}

// COLMAP's features are an alternative, neither cheaper nor dearer than this program's.
Dial FinderDial(const ReconstructOptions& o) {
  return {"features by",
          {0, 1},
          UseOwnFeatures(o) ? 0 : 1,
          [](ReconstructOptions& r, int v) { r.finder = v == 0 ? FeatureFinder::kOwn : FeatureFinder::kColmap; },
          [](int v) { return std::string(v == 0 ? "own features" : "COLMAP's features"); },
          [](int) { return 1.0; },
          false};
}

bool FollowsFrames(const ReconstructOptions& o, const ReconstructExtent& extent) {
  return extent.is_video || o.matching == Matching::kSequential;
}

std::vector<Dial> DialsOf(const ReconstructOptions& o, const ReconstructExtent& extent) {
  constexpr int kAny = std::numeric_limits<int>::max();
  const auto size_dial = [&](int limit) {
    // A limit beyond the photos' size does what their size does.
    const int given = std::min(limit, extent.longest_side_px);
    return Dial{"image size",
                Around(given, {0.25, 0.5, 2}, kLeastSidePx, extent.longest_side_px),
                given,
                [](ReconstructOptions& r, int v) { r.max_image_size_px = v; },
                [](int v) { return fmt::format("{} px", v); },
                InProportion};
  };
  const auto features_text = [](int v) { return fmt::format("features {}", v); };
  if (o.backend == Backend::kColmap) {
    const FeatureLimits limits = LimitsFor(o, static_cast<std::size_t>(std::max(0, extent.photos)));
    std::vector<Dial> dials{
        size_dial(limits.max_image_size_px),
        Dial{"features", Around(limits.max_features, {0.25, 0.5, 2}, kLeastFeatures, kAny), limits.max_features,
             [](ReconstructOptions& r, int v) { r.max_features = v; }, features_text, InProportion}};
    if (o.matching != Matching::kSequential && extent.photos > 2) dials.push_back(PairsDial(o, extent));
    dials.push_back(MapperDial(o, extent));
    dials.push_back(FinderDial(o));
    return dials;
  }
  const bool follow = FollowsFrames(o, extent);
  const int features = o.features > 0 ? o.features
                       : follow       ? TrackVideoOptions{}.features
                                      : MatchPhotosOptions{}.max_features;
  const int window = o.window_frames > 0 ? o.window_frames : WindowOptions{}.length;
  const int frames = o.all_frames ? kAny : std::max(kLeastWindow, extent.photos);
  const int effective = std::min(window, frames);
  std::vector<int> windows = Around(effective, {0.5, 2}, kLeastWindow, frames);
  std::erase_if(windows, [&](int v) { return v == effective || (v > effective && v < kLongerWindow * effective); });
  windows.push_back(window);
  std::ranges::sort(windows);
  std::vector<Dial> dials{Dial{"features", Around(features, {0.25, 0.5, 2}, kLeastFeatures, kAny), features,
                               [](ReconstructOptions& r, int v) { r.features = v; }, features_text, InProportion},
                          Dial{"window", windows, window, [](ReconstructOptions& r, int v) { r.window_frames = v; },
                               [](int v) { return fmt::format("window {}", v); }, InProportion},
                          Dial{"adjustment",
                               {0, 1},
                               o.adjust ? 1 : 0,
                               [](ReconstructOptions& r, int v) { r.adjust = v != 0; },
                               [](int v) { return std::string(v != 0 ? "adjusted" : "not adjusted"); },
                               [](int v) { return v != 0 ? kAdjustmentEffort : 1; }}};
  if (!follow)
    dials.push_back(size_dial(o.max_image_size_px > 0 ? o.max_image_size_px : MatchPhotosOptions{}.max_size_px));
  return dials;
}

// Cameras to be compared with, by the photos' names; a video's frames also by their numbers.
class ReferencePoses {
 public:
  explicit ReferencePoses(const Scene& scene) {
    std::map<std::string, int> stems;
    for (const View& view : scene.views) ++stems[fs::path(view.name).stem().string()];
    for (const View& view : scene.views) {
      const std::string stem = fs::path(view.name).stem().string();
      by_name_[view.name] = view.cam_from_world;
      if (stems[stem] == 1) by_stem_[stem] = view.cam_from_world;
      if (view.frame_index) by_frame_[*view.frame_index] = view.cam_from_world;
    }
  }
  const Rigid3* Find(const View& view) const {
    if (const auto it = by_name_.find(view.name); it != by_name_.end()) return &it->second;
    if (const auto it = by_stem_.find(fs::path(view.name).stem().string()); it != by_stem_.end()) return &it->second;
    if (!view.frame_index) return nullptr;
    const auto it = by_frame_.find(*view.frame_index);
    return it == by_frame_.end() ? nullptr : &it->second;
  }
  std::size_t Shared(const Scene& scene) const {
    return static_cast<std::size_t>(
        std::ranges::count_if(scene.views, [&](const View& v) { return Find(v) != nullptr; }));
  }
  std::optional<PoseErrors> Errors(const Scene& scene) const {
    if (scene.frame != Frame::kMetric || Shared(scene) < kLeastShared) return std::nullopt;
    std::vector<Rigid3> found, reference;
    for (const View& view : scene.views)
      if (const Rigid3* pose = Find(view)) {
        found.push_back(view.cam_from_world);
        reference.push_back(*pose);
      }
    return ComparePoses(found, reference);
  }

 private:
  std::map<std::string, Rigid3> by_name_, by_stem_;
  std::map<int, Rigid3> by_frame_;
};

Scene CamerasAsTheyAre(const fs::path& path) {
  OpenOptions open;
  open.check_photos = false;
  open.undistort = false;
  std::error_code ec;
  // A model alone will do: the truth of a simulated capture has no photos beside it.
  if (!fs::exists(path / "lumigraph.json", ec))
    if (const auto model = FindColmapModel(path)) return ReadColmapModel(*model);
  return OpenScene(path, open, SilentProgress());
}

Scene GivenReference(const fs::path& path) {
  std::error_code ec;
  if (!fs::exists(path, ec)) throw InputError(path, "no such file or folder");
  Scene scene = CamerasAsTheyAre(path);
  if (scene.frame != Frame::kMetric)
    throw UsageError(
        fmt::format("--reference {}: its frame is {}, metric cameras are compared", path.string(), Name(scene.frame)));
  return scene;
}

// CAPTURE/truth of photos that lie in CAPTURE/images.
std::optional<fs::path> TruthBeside(const fs::path& input) {
  std::error_code ec;
  if (!fs::is_directory(input, ec)) return std::nullopt;
  fs::path photos = fs::absolute(input).lexically_normal();
  if (!photos.has_filename()) photos = photos.parent_path();
  const fs::path truth = photos.parent_path() / "truth";
  return FindColmapModel(truth) ? std::optional(truth) : std::nullopt;
}

// One setting's progress as a step of all settings'.
class SettingProgress : public ProgressSink {
 public:
  SettingProgress(ProgressSink& sink, std::string task, long done, long total,
                  std::chrono::steady_clock::time_point start, double seconds_left)
      : sink_(sink), task_(std::move(task)), done_(done), total_(total), start_(start), left_(seconds_left) {
    Report({}, 0, 0, 0, 0);
  }
  void Report(const std::string&, long, long, double, double) override {
    sink_.Report(task_, done_, total_, SecondsSince(start_),
                 left_ < 0 ? -1 : std::max(0.0, left_ - SecondsSince(begin_)));
  }
  void Finish(const std::string&, long, double) override {}
  void Message(const std::string&) override {}

 private:
  ProgressSink& sink_;
  const std::string task_;
  const long done_, total_;
  const std::chrono::steady_clock::time_point start_, begin_ = std::chrono::steady_clock::now();
  const double left_;
};

double SecondsOfGiven(const ReconstructTradeoff& t) {
  return t.rows.empty() || !t.rows.front().failed.empty() ? 0 : t.rows.front().seconds;
}

// By the centres where rows have poses, else by the reprojection error; of rows that placed as many photos as any did.
// The fastest first.
std::vector<std::size_t> FrontOf(const std::vector<TradeoffRow>& rows) {
  int most = 0;
  bool posed = false;
  for (const TradeoffRow& row : rows) {
    if (row.failed.empty()) most = std::max(most, row.images_registered);
    posed = posed || row.poses;
  }
  std::vector<CostAndQuality> axes;
  for (const TradeoffRow& row : rows) {
    const bool able = row.failed.empty() && row.images_registered == most && !row.is_reference && (row.poses || !posed);
    axes.push_back(
        !able ? CostAndQuality()
              : CostAndQuality{row.seconds, -(posed ? row.poses->centre_rms_percent : row.mean_reprojection_error_px)});
  }
  return ParetoFront(axes);
}

TradeoffTable TableOf(const ReconstructTradeoff& t) {
  using Row = TradeoffRow;
  using enum TradeoffRole;
  const bool colmap = t.backend == Backend::kColmap;
  const double given = SecondsOfGiven(t);
  const auto pose = [](double PoseErrors::*figure) {
    return [figure](const Row& r) { return r.poses ? TradeoffValue((*r.poses).*figure) : TradeoffValue(); };
  };
  const auto option = [](bool there, auto ReconstructOptions::*value) {
    return [there, value](const Row& r) { return there ? TradeoffValue(r.setting.options.*value) : TradeoffValue(); };
  };
  const std::string features = colmap ? "settings.max_features" : "settings.features";
  TradeoffTable table = TradeoffTableOf<Row>(
      {{{"name", kSetting, "setting", -20, "{}", "setting"}, [](const Row& r) { return r.setting.name; }},
       {{"line", kSetting}, [](const Row& r) { return r.setting.line; }},
       {{features, kSetting, "", 0, "", "features"},
        option(true, colmap ? &ReconstructOptions::max_features : &ReconstructOptions::features)},
       {{"settings.matching", kSetting},
        [=](const Row& r) { return colmap ? TradeoffValue(Name(r.setting.options.matching)) : TradeoffValue(); }},
       {{"settings.partners", kSetting},
        [=](const Row& r) {
          return colmap && r.setting.options.partners > 0 ? TradeoffValue(r.setting.options.partners) : TradeoffValue();
        }},
       {{"settings.mapper", kSetting},
        [=](const Row& r) { return colmap ? TradeoffValue(Name(r.setting.options.mapper)) : TradeoffValue(); }},
       {{"settings.finder", kSetting},
        [=](const Row& r) {
          return colmap ? TradeoffValue(UseOwnFeatures(r.setting.options) ? "own" : "colmap") : TradeoffValue();
        }},
       {{"settings.window", kSetting}, option(!colmap, &ReconstructOptions::window_frames)},
       {{"settings.adjust", kSetting}, option(!colmap, &ReconstructOptions::adjust)},
       {{"settings.max_image_size", kSetting},
        [](const Row& r) {
          return r.setting.options.max_image_size_px > 0 ? TradeoffValue(r.setting.options.max_image_size_px)
                                                         : TradeoffValue();
        }},
       {{"seconds", kCost, "seconds", 9, "{:.1f}"}, &Row::seconds},
       {{"seconds_ratio", kCost, "ratio", 6, "{:.2f}"},
        [&](const Row& r) { return given > 0 && r.failed.empty() ? r.seconds / given : CostAndQuality::kNone; }},
       {{"images_registered"}, &Row::images_registered},
       {{"images_total"}, &Row::images_total},
       {{"", kFigure, "photos", 9},
        [](const Row& r) { return fmt::format("{}/{}", r.images_registered, r.images_total); }},
       {{"points", kFigure, "points", 7}, &Row::points},
       {{"mean_reprojection_error_px", kLessIsBetter, "px", 7, "{:.3f}"}, &Row::mean_reprojection_error_px},
       {{"centre_rms_percent", kLessIsBetter, "centres %", 10, "{:.4f}"}, pose(&PoseErrors::centre_rms_percent)},
       {{"centre_max_percent"}, pose(&PoseErrors::centre_max_percent)},
       {{"rotation_rms_deg", kLessIsBetter, "degrees", 10, "{:.4f}"}, pose(&PoseErrors::rotation_rms_deg)},
       {{"rotation_max_deg"}, pose(&PoseErrors::rotation_max_deg)},
       {{"upgrade"}, &Row::upgrade},
       {{"reference"}, &Row::is_reference},
       {{"front"}, &Row::on_front},
       {{"failed", kFailed}, &Row::failed},
       {{"", kRemark},
        [](const Row& r) { return r.is_reference          ? "the reference"
                                  : r.upgrade != "metric" ? r.upgrade
                                                          : ""; }}},
      t.rows);
  table.starred = "front";
  table.facts = {{"backend", Name(t.backend)}, {"reference", t.reference}, {"seconds", t.seconds}};
  return table;
}

std::vector<Plot> PanelsOf(const ReconstructTradeoff& t) {
  const TradeoffTable table = TableOf(t);
  const bool posed = std::ranges::any_of(t.rows, [](const TradeoffRow& row) { return row.poses.has_value(); });
  std::vector<Plot> panels;
  const auto panel = [&](const char* title, const std::string& subtitle, const char* y, const char* label, bool front) {
    panels.push_back(PlotOf(table, {title,
                                    subtitle,
                                    "seconds",
                                    {"seconds", true},
                                    y,
                                    {label, true},
                                    {{"", "as given", "#24292f", Marker::kDiamond},
                                     {"features", "", "#1f6feb"},
                                     {"window", "", "#15803d", Marker::kSquare},
                                     {"adjustment", "", "#cf222e", Marker::kCross},
                                     {"image size", "", "#b45309", Marker::kSquare},
                                     {"pairs", "", "#0f766e", Marker::kSquare},
                                     {"mapper", "", "#be185d", Marker::kCross},
                                     {"features by", "", "#57606a", Marker::kCross},
                                     {"several", "", "#9333ea"}},
                                    "line",
                                    "",
                                    front ? FrontOf(t.rows) : std::vector<std::size_t>(),
                                    false,
                                    kLeastShownError}));
  };
  if (posed) {
    panel("Camera centres", "against " + t.reference, "centre_rms_percent", "rms, % of their extent", true);
    panel("Rotations", "against " + t.reference, "rotation_rms_deg", "rms, degrees", false);
  }
  panel("Reprojection error", "of each setting's own points", "mean_reprojection_error_px", "mean, px", !posed);
  return panels;
}

// The dearest of those that placed the most photos: -1 where no row is metric.
std::ptrdiff_t BestRow(const std::vector<TradeoffRow>& rows, const std::vector<std::optional<Scene>>& scenes) {
  std::ptrdiff_t best = -1;
  const auto rank = [&](std::size_t i) { return std::pair(rows[i].images_registered, rows[i].setting.effort); };
  for (std::size_t i = 0; i < rows.size(); ++i)
    if (scenes[i] && scenes[i]->frame == Frame::kMetric && scenes[i]->views.size() >= kLeastShared &&
        (best < 0 || rank(i) > rank(static_cast<std::size_t>(best))))
      best = static_cast<std::ptrdiff_t>(i);
  return best;
}

}  // namespace

std::vector<ReconstructSetting> TradeoffSettings(const ReconstructOptions& options, const ReconstructExtent& extent) {
  const std::vector<Dial> dials = DialsOf(options, extent);
  std::vector<ReconstructSetting> settings;
  std::vector<std::vector<int>> taken;
  const auto add = [&](const std::vector<int>& values) {
    if (std::ranges::find(taken, values) != taken.end()) return;
    taken.push_back(values);
    ReconstructSetting s;
    s.options = options;
    s.options.tradeoff = false;
    s.options.reference.clear();
    s.options.database_beside = false;
    int turned = 0;
    std::string all;
    for (std::size_t d = 0; d < dials.size(); ++d) {
      const Dial& dial = dials[d];
      dial.set(s.options, values[d]);
      s.effort *= dial.effort(values[d]) / dial.effort(dial.given);
      all += (d > 0 ? ", " : "") + dial.text(values[d]);
      if (values[d] == dial.given) continue;
      s.name += (turned > 0 ? ", " : "") + dial.text(values[d]);
      s.line = turned++ > 0 ? "several" : dial.line;
    }
    if (turned == 0) s.name = "as given: " + all;
    settings.push_back(std::move(s));
  };
  std::vector<int> given, cheapest, dearest;
  for (const Dial& dial : dials) {
    given.push_back(dial.given);
    cheapest.push_back(dial.has_ends ? dial.values.front() : dial.given);
    dearest.push_back(dial.has_ends ? dial.values.back() : dial.given);
  }
  add(given);
  for (std::size_t d = 0; d < dials.size(); ++d)
    for (const int value : dials[d].values) {
      std::vector<int> turned = given;
      turned[d] = value;
      add(turned);
    }
  add(cheapest);
  add(dearest);
  return settings;
}

void MarkFront(std::vector<TradeoffRow>& rows) {
  for (TradeoffRow& row : rows) row.on_front = false;
  for (const std::size_t i : FrontOf(rows)) rows[i].on_front = true;
}

MeasuredReconstruction ReconstructWithTradeoff(const ReconstructOptions& options, ProgressSink& sink) {
  if (const std::string wrong = Validate(options); !wrong.empty()) throw UsageError(wrong, "see --help");
  // Read before the scene is written: it may be the one that is written.
  std::optional<ReferencePoses> reference;
  std::string reference_name;
  if (!options.reference.empty()) {
    reference.emplace(GivenReference(options.reference));
    reference_name = options.reference.string();
  }
  MeasuredReconstruction measured;
  std::error_code ec;
  ReconstructOptions made = options;
  // Cameras that lie beside the photos are nothing to measure.
  if (fs::is_directory(options.input, ec) && options.inputs.size() < 2) made.poses = kCamerasAnew;
  made.tradeoff = false;
  made.reference.clear();
  measured.summary = Reconstruct(made, sink);

  const auto start = std::chrono::steady_clock::now();
  ReconstructTradeoff& t = measured.tradeoff;
  t.backend = options.backend;
  const Scene scene = CamerasAsTheyAre(options.scene);
  ReconstructExtent extent;
  extent.is_video = fs::is_regular_file(options.input, ec);
  extent.photos = extent.is_video ? measured.summary.keyframes : measured.summary.images_total;
  for (const View& view : scene.views)
    extent.longest_side_px = std::max(extent.longest_side_px, SizePx(scene, view).maxCoeff());
  if (reference && reference->Shared(scene) < kLeastShared)
    throw DataError(fmt::format("{} has cameras for {} of the photos: three are needed to compare", reference_name,
                                reference->Shared(scene)),
                    "photos are found by their names, a video's frames by frame_index too", options.reference);
  if (const auto truth = reference ? std::nullopt : TruthBeside(options.input)) {
    reference.emplace(CamerasAsTheyAre(*truth));
    if (reference->Shared(scene) < kLeastShared)
      reference.reset();
    else
      reference_name = truth->string();
  }

  const std::vector<ReconstructSetting> settings = TradeoffSettings(options, extent);
  const long total = static_cast<long>(settings.size());
  const bool fresh = std::ranges::find(measured.summary.reused, "everything") == measured.summary.reused.end();
  std::vector<std::optional<Scene>> scenes;
  for (const ReconstructSetting& setting : settings) {
    CheckInterrupted();
    const long done = static_cast<long>(t.rows.size());
    const double each = done > 0 ? SecondsSince(start) / static_cast<double>(done)
                        : fresh  ? measured.summary.seconds
                                 : -1;
    SettingProgress progress(sink, "measuring, " + setting.name, done, total, start,
                             each < 0 ? -1 : each * static_cast<double>(total - done));
    TradeoffRow row;
    row.setting = setting;
    scenes.emplace_back();
    const TemporaryFolder folder;
    ReconstructOptions run = setting.options;
    run.poses = made.poses;
    run.scene = folder / "scene";
    const auto begin = std::chrono::steady_clock::now();
    try {
      const ReconstructSummary summary = Reconstruct(run, progress);
      row.seconds = summary.seconds;
      row.images_registered = summary.images_registered;
      row.images_total = summary.images_total;
      row.points = summary.points;
      row.mean_reprojection_error_px = summary.mean_reprojection_error_px;
      row.upgrade = summary.upgrade;
      scenes.back() = CamerasAsTheyAre(run.scene);
      scenes.back()->points.clear();
    } catch (const Interrupted&) {
      throw;
    } catch (const std::bad_alloc&) {
      row.failed = "out of memory";
    } catch (const std::exception& e) {
      CheckInterrupted();  // what failed because it was told to end
      row.failed = e.what();
    }
    if (!row.failed.empty()) {
      row.seconds = SecondsSince(begin);
      sink.Message(fmt::format("{} failed: {}", setting.name, row.failed));
    }
    t.rows.push_back(std::move(row));
  }
  CheckInterrupted();
  sink.Finish("measuring settings", total, SecondsSince(start));

  if (!reference)
    if (const std::ptrdiff_t best = BestRow(t.rows, scenes); best >= 0) {
      const auto i = static_cast<std::size_t>(best);
      reference.emplace(*scenes[i]);
      t.rows[i].is_reference = true;
      reference_name = "the dearest setting's own cameras (" + t.rows[i].setting.name + ")";
    }
  t.reference = reference_name;
  for (std::size_t i = 0; i < t.rows.size(); ++i)
    if (reference && scenes[i] && !t.rows[i].is_reference) t.rows[i].poses = reference->Errors(*scenes[i]);
  MarkFront(t.rows);
  t.seconds = SecondsSince(start);

  const FolderLock lock(options.scene);
  t.files = WriteTradeoff(options.scene / "tradeoff" / Name(t.backend), TableOf(t), PanelsOf(t));
  return measured;
}

std::string TradeoffCsv(const ReconstructTradeoff& t) { return CsvOf(TableOf(t)); }

std::string TradeoffSvg(const ReconstructTradeoff& t) { return SvgOf(PanelsOf(t)); }

void ListKeys(JsonKeys& j, MeasuredReconstruction& measured) {
  ReconstructTradeoff& t = measured.tradeoff;
  ListKeys(j, measured.summary);
  j.Say("tradeoff", KeysOf(TableOf(t)));
  j("tradeoff_json", t.files.json, "tradeoff_csv", t.files.csv, "tradeoff_svg", t.files.svg);
}

std::string Describe(const MeasuredReconstruction& measured) {
  return Describe(measured.summary) + "\n\n" + Describe(measured.tradeoff);
}

std::string Describe(const ReconstructTradeoff& t) {
  return TextOf(TableOf(t)) + "\n* no other setting is both faster and better" +
         (t.reference.empty() ? "" : "; centres and rotations (rms, aligned) against " + t.reference) +
         fmt::format("\n{}, .csv, .svg; {:.0f} s", t.files.json.string(), t.seconds);
}

}  // namespace lumi
