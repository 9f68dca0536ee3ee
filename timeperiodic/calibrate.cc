#include "timeperiodic/calibrate.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <nlohmann/json.hpp>

#include "scene/files/atomic_file.h"
#include "scene/files/image_io.h"
#include "scene/files/provenance.h"
#include "scene/files/scene_folder.h"
#include "scene/files/video.h"
#include "scene/program/child_progress.h"
#include "scene/program/error.h"
#include "scene/program/parallel.h"
#include "scene/program/stopwatch.h"
#include "scene/program/subprocess.h"
#include "scene/program/version.h"
#include "scene/tradeoff/held_out.h"
#include "timeperiodic/align.h"
#include "timeperiodic/commands.h"
#include "timeperiodic/frame_stack.h"
#include "timeperiodic/moving_parts.h"
#include "timeperiodic/period_plot.h"
#include "timeperiodic/sampling.h"

namespace lumi {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr const char* kOwnFolder = "timeperiodic";
constexpr int kMovingComponents = 48;
constexpr int kLeastHoldout = 8, kHeldOutViews = 24, kHeldOutWidth = 160;  // what --tradeoff renders: about so many frames of this width

// Frames of a video as lumi-reconstruct names them.
std::string MaskName(int frame) { return fmt::format("frame_{:06d}.jpg.png", frame); }

Json SamplingJson(const SamplingReport& r) {
  Json j;
  j["views"] = r.views;
  j["samples_per_window"] = r.samples_per_window;
  j["window_least"] = r.window_least;
  j["window_most"] = r.window_most;
  j["uniformity"] = r.uniformity;
  j["covered"] = r.covered;
  j["half_share"] = r.half_share;
  j["camera_period_frames"] = r.camera_period;
  j["commensurate"] = r.commensurate > 0 ? Json(fmt::format("{}:{}", r.commensurate_p, r.commensurate_q)) : Json(nullptr);
  j["gaps"] = Json::array();
  for (const SamplingGap& g : r.gaps)
    j["gaps"].push_back({{"phase_from", g.phase_from},
                         {"phase_to", g.phase_to},
                         {"place_from", g.place_from},
                         {"place_to", g.place_to},
                         {"what_to_film", g.what_to_film}});
  j["warnings"] = r.warnings;
  return j;
}

// The views that have a time, in frames of 1 / fps.
std::vector<SampledView> SampledViews(const Scene& scene, double fps) {
  std::vector<SampledView> views;
  for (const View& v : scene.views)
    if (v.time_s)
      views.push_back({*v.time_s * fps, scene.frame == Frame::kMetric ? v.CentreInWorld() : MakeRenderView(scene, v).centre,
                       v.frame_index.value_or(static_cast<int>(views.size()))});
  std::sort(views.begin(), views.end(), [](const SampledView& a, const SampledView& b) { return a.time < b.time; });
  return views;
}

void WriteMasks(const FrameStack& stack, const Alignment& alignment, const MovingParts& parts, const fs::path& folder, ProgressSink& sink) {
  fs::remove_all(folder);
  fs::create_directories(folder);
  Progress progress(sink, "writing masks", stack.count());
  ParallelFor(stack.frames.size(), 4, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      WriteImage(folder / MaskName(static_cast<int>(i)), FrameMask(stack, alignment, parts, static_cast<int>(i)));
      progress.Step();
    }
  });
}

// lumi-reconstruct's summary.
Json Reconstruct(const CalibrateVideoOptions& o, const fs::path& masks, ProgressSink& progress) {
  std::vector<std::string> argv{SiblingProgram("lumi-reconstruct").string(),
                                o.video.string(),
                                "-o",
                                o.scene.string(),
                                "--all-frames",
                                "--masks",
                                masks.string(),
                                "--json",
                                "--threads",
                                std::to_string(o.threads),
                                "--seed",
                                std::to_string(o.seed)};
  argv.insert(argv.end(), o.reconstruct_arguments.begin(), o.reconstruct_arguments.end());
  SubprocessOptions subprocess;
  subprocess.separate_stdout = true;
  ChildProgress display(progress, "lumi-reconstruct: ");
  subprocess.environment["LUMI_PROGRESS_PIPE"] = "1";
  subprocess.on_line = [&](const std::string& line) {
    if (const auto parsed = ParseProgressLine(line))
      display.Show(*parsed);
    else
      progress.Message("lumi-reconstruct: " + line);
  };
  const SubprocessResult result = RunSubprocess(argv, subprocess);
  const Json json = Json::parse(result.out, nullptr, false);
  if (result.exit_code == static_cast<int>(ExitCode::kInterrupted)) throw Interrupted();
  if (result.exit_code != 0) {
    std::string why = fmt::format("it ended with {}", result.exit_code), hint;
    fs::path file = o.video;
    if (json.is_object() && json.contains("error")) {
      why = json["error"].value("message", why);
      hint = json["error"].value("hint", "");
    } else if (!result.tail.empty()) {
      why += ": " + result.tail.back();
    }
    const bool own = result.exit_code >= 1 && result.exit_code <= 4;
    throw Error(own ? static_cast<ExitCode>(result.exit_code) : ExitCode::kMachine, "lumi-reconstruct cannot place the cameras: " + why,
                file, hint);
  }
  if (!json.is_object()) throw MachineError("lumi-reconstruct printed no summary", "is it of the same version as this program?");
  return json;
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
  wanted.inputs[o.video.string()] = Fingerprint(o.video);
  if (!o.fixed_video.empty()) wanted.inputs[o.fixed_video.string()] = Fingerprint(o.fixed_video);
  if (!o.masks.empty()) wanted.inputs[o.masks.string()] = Fingerprint(o.masks);
  return wanted;
}

// Dials of the search against what they bring: the period, and the scene's held-out frames rendered with it.
std::string Tradeoff(const CalibrateVideoOptions& o, ProgressSink& progress) {
  const PeriodTradeoffOptions options{o.fixed_video.empty() ? o.video : o.fixed_video, o.fixed_video.empty(), o.period, o.width_px, o.period_frames};
  const double fps = VideoReader(options.video).fps();
  OpenOptions open;
  open.check_photos = false;
  Scene scene = OpenScene(o.scene, open, progress);
  const HeldOutBench bench(o.scene, std::max(kLeastHoldout, static_cast<int>(scene.views.size()) / kHeldOutViews), kHeldOutWidth);
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
  const TradeoffTable table = MeasurePeriodTradeoff(options, held_out, progress);
  const FolderLock lock(o.scene);
  return PeriodTradeoffJson(table, WritePeriodTradeoff(o.scene / "tradeoff", table));
}

}  // namespace

std::optional<std::string> Validate(const CalibrateVideoOptions& o) {
  if (o.video.empty()) return "say which video";
  if (o.scene.empty()) return "say where the scene goes: -o SCENE";
  if (o.period_frames && !o.fixed_video.empty()) return "--period-frames and --fixed-video do not go together: both say the period";
  if (o.period_frames && !(*o.period_frames > 0)) return "--period-frames must be > 0";
  if (o.masks_only && o.tradeoff) return "--tradeoff measures the scene, which --masks-only does not make";
  if (o.masks_only && !o.masks.empty()) return "--masks-only finds masks, --masks gives them";
  return Validate(o.period);
}

namespace {

Json Calibrated(const CalibrateVideoOptions& o, ProgressSink& progress) {
  const auto start = std::chrono::steady_clock::now();
  if (o.period_frames) RequireResolved(*o.period_frames);
  for (const fs::path& file : {o.video, o.fixed_video, o.masks})
    if (!file.empty() && !fs::exists(file)) throw InputError(file, "no such file or folder");
  const fs::path own = o.scene / kOwnFolder, summary_file = own / "summary.json";
  RequireOurFolder(o.scene, "provenance");
  Provenance wanted = Wanted(o);
  if (fs::exists(summary_file) && IsUpToDate(o.scene, wanted)) {
    Json json = Json::parse(ReadText(summary_file));
    json["reused"] = true;
    json["seconds"] = SecondsSince(start);
    return json;
  }

  FrameStackOptions reading;
  reading.max_width_px = o.width_px;
  const FrameStack stack = ReadFrameStack(o.video, reading, progress);
  if (stack.truncated)
    progress.Message(fmt::format("{} is cut off: its first {} frames are used", o.video.filename().string(), stack.count()));
  std::optional<Alignment> alignment;
  if (o.masks.empty() || (!o.period_frames && o.fixed_video.empty())) alignment = AlignFrames(stack, {}, progress);

  // The period, in frames of the moving video.
  PeriodEstimate estimate;
  std::string period_from = "given";
  if (o.period_frames) {
    estimate.period_frames = *o.period_frames;
    estimate.candidates.push_back({*o.period_frames, "taken", 1, 0});
  } else if (!o.fixed_video.empty()) {
    period_from = "fixed video";
    const FrameStack fixed = ReadFrameStack(o.fixed_video, reading, progress);
    estimate = EstimatePeriod(FixedSignals(fixed, {}), {}, o.period);
    const double ratio = stack.fps / fixed.fps;
    estimate.period_frames *= ratio;
    estimate.sigma_frames *= ratio;
    for (PeriodCandidate& c : estimate.candidates) c.period_frames *= ratio;
    RequireResolved(estimate.period_frames);
  } else {
    period_from = "moving video";
    estimate = EstimatePeriod(MovingSignals(stack, *alignment, {.components = kMovingComponents}), alignment->camera, o.period);
  }
  const double period = estimate.period_frames;
  for (const std::string& w : estimate.warnings) progress.Message(w);

  // What moves.
  Json masks_json;
  fs::path masks = o.masks;
  {
    const FolderLock lock(o.scene);
    fs::create_directories(o.scene / "provenance");  // marks the folder as ours
    fs::create_directories(own);
    if (period_from != "given") WriteTextAtomically(own / "period.svg", PeriodPlot(estimate));
    if (masks.empty()) {
      const MovingParts parts = FindMovingParts(stack, *alignment, period, {});
      masks_json = {
          {"found", true}, {"moving_share", parts.share}, {"corners", alignment->corners}, {"aligned_frames", alignment->frames.size()}};
      if (parts.share > o.max_moving_share)
        throw DataError(fmt::format("too little of the picture stands still: {:.0f} % of it moves", 100 * parts.share),
                        "film with more of a still background in view, or give masks (--masks)", o.video);
      if (parts.share == 0) progress.Message("nothing was found that moves with this period: no masks");
      masks = own / "masks";
      WriteMasks(stack, *alignment, parts, masks, progress);
    } else {
      masks_json = {{"found", false}};
    }
  }

  Json json = Json::parse(PeriodJson(estimate, stack.fps, stack.count()));
  json["period_from"] = period_from;
  json["scene"] = o.scene.string();
  json["masks"] = masks_json;
  json["reused"] = false;
  if (!o.masks_only) {
    json["reconstruct"] = Reconstruct(o, masks, progress);
    const FolderLock lock(o.scene);
    OpenOptions open;
    open.check_photos = false;
    Scene scene = OpenScene(o.scene, open, progress);
    scene.period_s = period / stack.fps;
    // Frames that were dropped put those after them later than the file says.
    for (View& v : scene.views) {
      if (!v.frame_index || *v.frame_index >= stack.count()) continue;
      v.time_s = stack.time[static_cast<std::size_t>(*v.frame_index)] / stack.fps;
      if (period_from == "moving video")
        for (const Slip& slip : estimate.slips)
          if (*v.frame_index >= slip.frame) *v.time_s += slip.frames / stack.fps;
    }
    WriteManifest(scene, o.scene);
    const std::vector<SampledView> views = SampledViews(scene, stack.fps);
    if (views.size() < 2) throw DataError("fewer than two frames got a camera", "see the messages of lumi-reconstruct", o.video);
    const SamplingReport report = ReportSampling(views, period);
    for (const std::string& w : report.warnings) progress.Message(w);
    WriteTextAtomically(own / "sampling.svg", SamplingPlot(report, views));
    json["images_registered"] = views.size();
    json["samples_per_window"] = report.samples_per_window;
    json["sampling"] = SamplingJson(report);
    for (const std::string& w : report.warnings) json["warnings"].push_back(w);
  }
  json["seconds"] = wanted.seconds = SecondsSince(start);
  const FolderLock lock(o.scene);
  WriteTextAtomically(summary_file, json.dump(1) + "\n");
  wanted.outputs[(fs::path(kOwnFolder) / "summary.json").string()] = Fingerprint(summary_file);
  WriteProvenance(o.scene, wanted);
  return json;
}

}  // namespace

std::string CalibrateVideo(const CalibrateVideoOptions& o, ProgressSink& progress) {
  if (const auto wrong = Validate(o)) throw UsageError(*wrong);
  Json json = Calibrated(o, progress);
  if (o.tradeoff) json.update(Json::parse(Tradeoff(o, progress)));
  return json.dump();
}

std::string DescribeCalibratedVideo(const std::string& text) {
  const auto j = Json::parse(text);
  std::string lines = fmt::format("period {:.6g} frames +- {:.2g} (from the {})", j["period_frames"].get<double>(),
                                  j["period_sigma_frames"].get<double>(), j["period_from"].get<std::string>());
  if (j["masks"].value("found", false))
    lines += fmt::format("; {:.1f} % of the picture moves", 100 * j["masks"]["moving_share"].get<double>());
  if (!j.contains("sampling"))
    return lines + "\nmasks in " + j["scene"].get<std::string>() + "/timeperiodic/masks: look at them, and give them with --masks";
  const auto& s = j["sampling"];
  lines += fmt::format("\n{} of {} frames have a camera: {:.3g} samples in a window of one frame ({:.0f} to {:.0f}), uniformity {:.2f}",
                       j["images_registered"].get<int>(), j["frames"].get<int>(), s["samples_per_window"].get<double>(),
                       s["window_least"].get<double>(), s["window_most"].get<double>(), s["uniformity"].get<double>());
  for (const auto& g : s["gaps"]) lines += "\n  gap: " + g["what_to_film"].get<std::string>();
  return lines + DescribePeriodTradeoff(text);
}

std::string ReportSceneSampling(const fs::path& folder, const fs::path& plot, ProgressSink& progress) {
  OpenOptions open;
  open.check_photos = open.undistort = false;
  const Scene scene = OpenScene(folder, open, progress);
  if (!scene.period_s) throw DataError("the scene has no period", "lumi-timeperiodic calibrate finds it", folder);
  // Frames per second: of the numbers and times that the views carry.
  std::vector<std::pair<double, int>> numbered;
  for (const View& v : scene.views)
    if (v.time_s && v.frame_index) numbered.emplace_back(*v.time_s, *v.frame_index);
  std::sort(numbered.begin(), numbered.end());
  double fps = 1;
  if (numbered.size() >= 2 && numbered.back().first > numbered.front().first && numbered.back().second > numbered.front().second)
    fps = (numbered.back().second - numbered.front().second) / (numbered.back().first - numbered.front().first);
  const std::vector<SampledView> views = SampledViews(scene, fps);
  if (views.size() < 2) throw DataError("fewer than two photos of the scene carry a time", "it needs a video", folder);
  const SamplingReport report = ReportSampling(views, *scene.period_s * fps);
  for (const std::string& w : report.warnings) progress.Message(w);
  if (!plot.empty()) WriteTextAtomically(plot, SamplingPlot(report, views));
  Json json = SamplingJson(report);
  json["period_frames"] = *scene.period_s * fps;
  json["period_s"] = *scene.period_s;
  json["fps"] = fps;
  return json.dump();
}

}  // namespace lumi
