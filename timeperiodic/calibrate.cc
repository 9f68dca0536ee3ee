#include "timeperiodic/calibrate.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>

#include "scene/files/atomic_file.h"
#include "scene/files/image_io.h"
#include "scene/files/provenance.h"
#include "scene/files/scene_folder.h"
#include "scene/files/svg_file.h"
#include "scene/files/video_clock.h"
#include "scene/program/error.h"
#include "scene/program/parallel_each.h"
#include "scene/program/sibling.h"
#include "scene/program/stopwatch.h"
#include "scene/program/version.h"
#include "scene/tradeoff/held_out.h"
#include "timeperiodic/align.h"
#include "timeperiodic/frame_stack.h"
#include "timeperiodic/moving_parts.h"
#include "timeperiodic/period_plot.h"
#include "timeperiodic/period_tradeoff.h"
#include "timeperiodic/sampling.h"

namespace lumi {
namespace {

namespace fs = std::filesystem;

// Where a period comes from.
constexpr const char *kGiven = "given", *kFixedVideo = "fixed video", *kMovingVideo = "moving video";
constexpr const char* kOwnFolder = "timeperiodic";
constexpr int kMovingComponents = 48;
constexpr int kLeastHoldout = 8, kHeldOutViews = 24,
              kHeldOutWidth = 160;  // what --tradeoff renders: about so many frames of this width

// Frames of a video as lumi-reconstruct names them.
std::string MaskName(int frame) { return fmt::format("frame_{:06d}.jpg.png", frame); }

// The views that have a time, in frames of 1 / fps.
std::vector<SampledView> SampledViews(const Scene& scene, double fps) {
  std::vector<SampledView> views;
  for (const View& v : scene.views)
    if (v.time_s)
      views.push_back({*v.time_s * fps,
                       scene.frame == Frame::kMetric ? v.CentreInWorld() : MakeRenderView(scene, v).centre,
                       v.frame_index.value_or(static_cast<int>(views.size()))});
  std::ranges::sort(views, [](const SampledView& a, const SampledView& b) { return a.time < b.time; });
  return views;
}

// Masks are made to be edited, and are found anew only where nobody did.
void RequireMasksAsMade(const fs::path& scene) {
  const fs::path masks = scene / kOwnFolder / "masks";
  std::error_code error;
  auto record = ReadProvenance(scene, kOwnFolder);
  if (!record || !fs::exists(masks, error)) return;
  const auto made = record->outputs.find((fs::path(kOwnFolder) / "masks").string());
  if (made == record->outputs.end()) return;
  if (made->second != Fingerprint(masks))
    throw UsageError(masks.string() + " was changed since it was made, and would be made anew",
                     "give it back with --masks " + masks.string() + ", or remove it");
  // From here on they are this run's, also where it is interrupted.
  record->outputs.erase(made);
  WriteProvenance(scene, *record);
}

void WriteMasks(const FrameStack& stack, const Alignment& alignment, const MovingParts& parts, const fs::path& folder,
                ProgressSink& sink) {
  fs::remove_all(folder);
  fs::create_directories(folder);
  Progress progress(sink, "writing masks", stack.count());
  ParallelEach(stack.frames.size(), 4, [&](std::size_t i) {
    WriteImage(folder / MaskName(static_cast<int>(i)), FrameMask(stack, alignment, parts, static_cast<int>(i)));
    progress.Step();
  });
}

// lumi-reconstruct's summary.
JsonKeys Reconstruct(const CalibrateVideoOptions& o, const fs::path& masks, ProgressSink& progress) {
  std::vector<std::string> arguments{
      o.video.string(), "-o",        o.scene.string(),          "--all-frames", "--masks",
      masks.string(),   "--threads", std::to_string(o.threads), "--seed",       std::to_string(o.seed)};
  arguments.insert(arguments.end(), o.reconstruct_arguments.begin(), o.reconstruct_arguments.end());
  try {
    return RunSibling({"lumi-reconstruct", arguments, "lumi-reconstruct: ", "lumi-reconstruct: "}, progress).summary;
  } catch (const Interrupted&) {
    throw;
  } catch (const Error& e) {
    throw Error(e.code() == ExitCode::kBug ? ExitCode::kMachine : e.code(),
                std::string("lumi-reconstruct cannot place the cameras: ") + e.what(), o.video, e.hint());
  }
}

Provenance Wanted(const CalibrateVideoOptions& o) {
  Provenance wanted;
  wanted.stage = kOwnFolder;
  wanted.version = kVersion;
  wanted.options = {{"period_frames", o.period_frames ? fmt::format("{:.17g}", *o.period_frames) : ""},
                    {"min_period", fmt::format("{}", o.period.min_period)},
                    {"max_period", fmt::format("{}", o.period.max_period)},
                    {"width", std::to_string(o.width_px)},
                    {"masks_only", o.masks_only ? "yes" : "no"},
                    {"seed", std::to_string(o.seed)}};
  std::string passed;
  for (const std::string& a : o.reconstruct_arguments) passed += a + "\n";
  wanted.options["reconstruct"] = passed;
  // A camera.yaml that was measured anew under its old name gives other cameras.
  for (std::size_t i = 1; i < o.reconstruct_arguments.size(); ++i)
    if (o.reconstruct_arguments[i - 1] == "--camera")
      wanted.inputs[o.reconstruct_arguments[i]] = Fingerprint(o.reconstruct_arguments[i]);
  wanted.inputs[o.video.string()] = Fingerprint(o.video);
  if (!o.fixed_video.empty()) wanted.inputs[o.fixed_video.string()] = Fingerprint(o.fixed_video);
  if (!o.masks.empty()) wanted.inputs[o.masks.string()] = Fingerprint(o.masks);
  return wanted;
}

// Settings of the search against their results: the period, and the error of held-out frames rendered with it.
PeriodTradeoff Tradeoff(const CalibrateVideoOptions& o, ProgressSink& progress) {
  const PeriodTradeoffOptions options{o.fixed_video.empty() ? o.video : o.fixed_video, o.fixed_video.empty(), o.period,
                                      o.width_px, o.period_frames};
  const double fps = VideoClock(ReadUsableTimes(options.video)).fps();
  OpenOptions open;
  open.check_photos = false;
  Scene scene = OpenScene(o.scene, open, progress);
  const HeldOutBench bench(o.scene, std::max(kLeastHoldout, static_cast<int>(scene.views.size()) / kHeldOutViews),
                           kHeldOutWidth);
  scene.image_folder = bench.folder() / "images";  // a link to the scene's own
  HeldOutByPeriod held_out = [&](double period_frames) {
    scene.period_s = period_frames / fps;
    WriteManifest(scene, bench.folder());
    return bench.Measure("plane").psnr_db;
  };
  try {
    bench.MakePlane();
  } catch (const Interrupted&) {
    throw;
  } catch (const Error& e) {
    progress.Message(std::string("no figures of held-out frames: ") + e.what());
    held_out = {};
  }
  PeriodTradeoff t{MeasurePeriodTradeoff(options, held_out, progress), {}};
  const FolderLock lock(o.scene);
  t.files = WritePeriodTradeoff(o.scene / "tradeoff", t.table);
  return t;
}

}  // namespace

std::optional<std::string> Validate(const CalibrateVideoOptions& o) {
  if (o.video.empty()) return "say which video";
  if (o.scene.empty()) return "say where the scene goes: -o SCENE";
  if (o.period_frames && !o.fixed_video.empty())
    return "--period-frames and --fixed-video do not go together: both say the period";
  if (o.period_frames && !(*o.period_frames > 0)) return "--period-frames must be > 0";
  if (o.masks_only && o.tradeoff) return "--tradeoff measures the scene, which --masks-only does not make";
  if (o.masks_only && !o.masks.empty()) return "--masks-only finds masks, --masks gives them";
  return Validate(o.period);
}

namespace {

// In frames of the moving video.
PeriodEstimate PeriodFor(const CalibrateVideoOptions& o, const FrameStack& stack,
                         const std::optional<Alignment>& alignment, const std::string& from, ProgressSink& progress) {
  PeriodEstimate estimate;
  if (from == kGiven) {
    estimate.period_frames = *o.period_frames;
    estimate.candidates.push_back({*o.period_frames, "taken", 1, 0});
  } else if (from == kFixedVideo) {
    const FrameStack fixed = ReadFrameStack(o.fixed_video, {.max_width_px = o.width_px}, progress);
    estimate = EstimatePeriod(FixedSignals(fixed, {}), {}, o.period);
    const double ratio = stack.fps / fixed.fps;
    estimate.period_frames *= ratio;
    estimate.sigma_frames *= ratio;
    for (PeriodCandidate& c : estimate.candidates) c.period_frames *= ratio;
    RequireResolved(estimate.period_frames);
  } else {
    estimate = EstimatePeriod(MovingSignals(stack, *alignment, {.components = kMovingComponents}), alignment->camera,
                              o.period);
  }
  for (const std::string& w : estimate.warnings) progress.Message(w);
  return estimate;
}

// What moves, as masks in a folder of our own.
fs::path MaskWhatMoves(const CalibrateVideoOptions& o, const FrameStack& stack, const Alignment& alignment,
                       CalibratedVideo& summary, ProgressSink& progress) {
  const MovingParts parts = FindMovingParts(stack, alignment, summary.period.estimate.period_frames, {});
  summary.masks = {true, parts.share, static_cast<int>(alignment.corners), static_cast<int>(alignment.frames.size())};
  if (parts.share > o.max_moving_share)
    throw DataError(fmt::format("too little of the picture stands still: {:.0f} % of it moves", 100 * parts.share),
                    "film with more of a still background in view, or give masks (--masks)", o.video);
  if (parts.share == 0) progress.Message("nothing was found that moves with this period: no masks");
  const fs::path masks = o.scene / kOwnFolder / "masks";
  WriteMasks(stack, alignment, parts, masks, progress);
  return masks;
}

// Cameras for the frames, and their times.
void PlaceFrames(const CalibrateVideoOptions& o, const FrameStack& stack, const fs::path& masks,
                 CalibratedVideo& summary, ProgressSink& progress) {
  PeriodEstimate& estimate = summary.period.estimate;
  summary.reconstruct = Reconstruct(o, masks, progress);
  const FolderLock lock(o.scene);
  OpenOptions open;
  open.check_photos = false;
  Scene scene = OpenScene(o.scene, open, progress);
  scene.period_s = estimate.period_frames / stack.fps;
  // Frames that were dropped put those after them later than the file says.
  for (View& v : scene.views) {
    if (!v.frame_index || *v.frame_index >= stack.count()) continue;
    v.time_s = stack.time[static_cast<std::size_t>(*v.frame_index)] / stack.fps;
    if (summary.period_from == kMovingVideo)
      for (const Slip& slip : estimate.slips)
        if (*v.frame_index >= slip.frame) *v.time_s += slip.frames / stack.fps;
  }
  WriteManifest(scene, o.scene);
  const std::vector<SampledView> views = SampledViews(scene, stack.fps);
  if (views.size() < 2)
    throw DataError("fewer than two frames got a camera", "see the messages of lumi-reconstruct", o.video);
  const SamplingReport report = ReportSampling(views, estimate.period_frames);
  for (const std::string& w : report.warnings) progress.Message(w);
  WriteTextAtomically(o.scene / kOwnFolder / "sampling.svg", SamplingPlot(report, views));
  summary.images_registered = static_cast<int>(views.size());
  summary.period.samples_per_window = report.samples_per_window;
  summary.sampling = report;
  estimate.warnings.insert(estimate.warnings.end(), report.warnings.begin(), report.warnings.end());
}

CalibratedVideo Calibrated(const CalibrateVideoOptions& o, ProgressSink& progress) {
  const auto start = std::chrono::steady_clock::now();
  if (o.period_frames) RequireResolved(*o.period_frames);
  for (const fs::path& file : {o.video, o.fixed_video, o.masks})
    if (!file.empty() && !fs::exists(file)) throw InputError(file, "no such file or folder");
  const fs::path own = o.scene / kOwnFolder, summary_file = own / "summary.json";
  RequireOurFolder(o.scene, "provenance");
  Provenance wanted = Wanted(o);
  if (fs::exists(summary_file) && (o.masks_only || fs::exists(o.scene / "lumigraph.json")) &&
      IsUpToDate(o.scene, wanted)) {
    const auto json = JsonKeys::Parse(ReadText(summary_file));
    if (!json) throw InputError(summary_file, "is no JSON object", "remove it, and the video is calibrated again");
    auto summary = json->As<CalibratedVideo>();
    summary.reused = true;
    summary.period.seconds = SecondsSince(start);
    return summary;
  }

  if (o.masks.empty()) RequireMasksAsMade(o.scene);
  const FrameStack stack = ReadFrameStack(o.video, {.max_width_px = o.width_px}, progress);
  if (stack.truncated)
    progress.Message(
        fmt::format("{} is cut off: its first {} frames are used", o.video.filename().string(), stack.count()));
  const std::string from = o.period_frames ? kGiven : o.fixed_video.empty() ? kMovingVideo : kFixedVideo;
  std::optional<Alignment> alignment;
  if (o.masks.empty() || from == kMovingVideo) alignment = AlignFrames(stack, {}, progress);

  CalibratedVideo summary;
  summary.period_from = from;
  PeriodEstimate& estimate = summary.period.estimate = PeriodFor(o, stack, alignment, from, progress);
  fs::path masks = o.masks;
  {
    const FolderLock lock(o.scene);
    fs::create_directories(o.scene / "provenance");  // marks the folder as ours
    fs::create_directories(own);
    if (from != kGiven) WriteTextAtomically(own / "period.svg", PeriodPlot(estimate));
    if (masks.empty()) masks = MaskWhatMoves(o, stack, *alignment, summary, progress);
  }

  summary.period.fps = stack.fps;
  summary.period.frames = stack.count();
  summary.period.samples_per_window = stack.count() / estimate.period_frames;
  summary.scene = o.scene;
  if (!o.masks_only) PlaceFrames(o, stack, masks, summary, progress);
  summary.period.seconds = wanted.seconds = SecondsSince(start);
  const FolderLock lock(o.scene);
  WriteTextAtomically(summary_file, JsonKeys(summary).Text(1) + "\n");
  // Outputs that a later run must find unchanged before it has nothing to do.
  std::error_code error;
  for (const char* file : {"summary.json", "period.svg", "sampling.svg", "masks"})
    if (fs::exists(own / file, error)) wanted.outputs[(fs::path(kOwnFolder) / file).string()] = Fingerprint(own / file);
  if (!o.masks_only) {
    for (const char* part : {"images", "sparse", "projective.json"})
      if (fs::exists(o.scene / part, error)) wanted.outputs[part] = Fingerprint(o.scene / part);
    wanted.outputs["lumigraph.json"] = kChangedLater;
  }
  WriteProvenance(o.scene, wanted);
  return summary;
}

}  // namespace

CalibratedVideo CalibrateVideo(const CalibrateVideoOptions& o, ProgressSink& progress) {
  if (const auto wrong = Validate(o)) throw UsageError(*wrong);
  CalibratedVideo summary = Calibrated(o, progress);
  if (o.tradeoff) summary.period.tradeoff = Tradeoff(o, progress);
  return summary;
}

SceneSampling ReportSceneSampling(const fs::path& folder, const fs::path& plot, ProgressSink& progress) {
  RequireSvgFile(plot);
  OpenOptions open;
  open.check_photos = open.undistort = false;
  const Scene scene = OpenScene(folder, open, progress);
  if (!scene.period_s) throw DataError("the scene has no period", "lumi-timeperiodic calibrate finds it", folder);
  // Frames per second: of the numbers and times that the views carry.
  std::vector<std::pair<double, int>> numbered;
  for (const View& v : scene.views)
    if (v.time_s && v.frame_index) numbered.emplace_back(*v.time_s, *v.frame_index);
  std::ranges::sort(numbered);
  double fps = 1;
  if (numbered.size() >= 2 && numbered.back().first > numbered.front().first &&
      numbered.back().second > numbered.front().second)
    fps = (numbered.back().second - numbered.front().second) / (numbered.back().first - numbered.front().first);
  const std::vector<SampledView> views = SampledViews(scene, fps);
  if (views.size() < 2) throw DataError("fewer than two photos of the scene carry a time", "it needs a video", folder);
  const SamplingReport report = ReportSampling(views, *scene.period_s * fps);
  for (const std::string& w : report.warnings) progress.Message(w);
  if (!plot.empty()) WriteTextAtomically(plot, SamplingPlot(report, views));
  return {report, *scene.period_s * fps, *scene.period_s, fps};
}

}  // namespace lumi
