#include "pipeline/pipeline.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <exception>
#include <functional>
#include <map>
#include <optional>
#include <set>

#include "pipeline/depth_maps_in_parts.h"
#include "pipeline/fitting_options.h"
#include "pipeline/import_scene.h"
#include "pipeline/input_kind.h"
#include "pipeline/qualities.h"
#include "pipeline/report/report.h"
#include "pipeline/sibling_summaries.h"
#include "pipeline/stage_runner.h"
#include "scene/files/atomic_file.h"
#include "scene/files/provenance.h"
#include "scene/files/video.h"
#include "scene/program/error.h"
#include "scene/program/parallel.h"
#include "scene/program/version.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

constexpr int kFewestPhotosForHoldout = 4;  // below, leaving one out says little about the rest

// Of the minutes that a run was given a fifth is for evaluation, film, page and report; depth maps get two thirds of
// what is left after the cameras, as auto meshes and measures besides. To a tenth of a minute.
double DepthMinutesOf(double minutes, double minutes_left) {
  constexpr double kForExtras = 0.2, kForDepth = 2.0 / 3;
  return std::floor(10 * std::max(0.0, (minutes_left - kForExtras * minutes) * kForDepth)) / 10;
}

// Removes folders that a failed stage left empty.
class RemoveIfEmpty {
 public:
  explicit RemoveIfEmpty(std::vector<fs::path> folders) : folders_(std::move(folders)) {}
  ~RemoveIfEmpty() {
    std::error_code ignored;
    for (const fs::path& folder : folders_) fs::remove(folder, ignored);
  }
  RemoveIfEmpty(const RemoveIfEmpty&) = delete;
  RemoveIfEmpty& operator=(const RemoveIfEmpty&) = delete;

 private:
  std::vector<fs::path> folders_;
};

class Run {
 public:
  Run(const PipelineOptions& options, ProgressSink& progress)
      : options_(options), progress_(progress), start_(Clock::now()) {}

  PipelineSummary Go() {
    const InputKind kind = ClassifyInput(options_.input);
    summary_.scene = options_.output.empty() && kind == InputKind::kOurScene ? options_.input : options_.output;
    if (summary_.scene.empty()) throw UsageError("-o SCENE is missing", "name the folder that the scene goes to");
    if (std::error_code error; HasVideoExtension(summary_.scene) && !fs::is_directory(summary_.scene, error))
      throw UsageError(fmt::format("-o {}: it names the folder of the scene, not a film", summary_.scene.string()),
                       "its fly-through is SCENE/fly-through.mp4; --stabilize MODEL makes a film of a shaky video");
    RequireOptionsForKind(options_, kind);
    if (options_.minutes) ChooseQuality();
    PipelineOptions placed = options_;
    placed.output = summary_.scene;
    RequireSeparatePaths(placed, kind);
    // With an executor, files are written there before the first stage's program checks the folder.
    if (options_.executor && kind != InputKind::kOurScene) RequireOurFolder(summary_.scene, "provenance");

    const bool in_place = kind == InputKind::kOurScene && IsWithin(summary_.scene, options_.input) &&
                          IsWithin(options_.input, summary_.scene);
    const bool calibrate = !options_.calibration.empty() && !IsCameraFile(options_.calibration);
    const int count = (calibrate ? 1 : 0) + (in_place ? 0 : 1) + (HasSilhouetteSource(options_) ? 1 : 0) + 1 +
                      (DepthMapsInParts() ? 1 : 0) + (options_.faces > 0 ? 1 : 0) + (options_.holdout > 0 ? 1 : 0) +
                      (options_.video ? 1 : 0) + (options_.web ? 1 : 0) + 1;

    stages_.emplace(summary_.scene, options_, count, progress_);
    Announce(kind, in_place, calibrate);
    if (calibrate) Calibrate();
    if (!in_place) MakeCameras(kind);
    if (HasSilhouetteSource(options_)) MakeSilhouettes();
    MakeProxy();
    if (options_.faces > 0) Simplify();
    if (options_.holdout > 0) OrReport(kHoldout, [&] { Evaluate(in_place); });
    if (options_.video && TimeFor(kVideo, options_.video_seconds * kFilmSecondsASecond))
      OrReport(kVideo, [&] { MakeVideo(); });
    if (options_.web && TimeFor(kWeb, kPageSeconds)) OrReport(kWeb, [&] { MakeWebPage(); });
    stages_->RunWaiting([&](const std::string& name, const std::function<void()>& keep) {
      OrReport(name, [&] { name == kWeb ? PageOrReason(keep) : keep(); });
    });
    try {
      Report();
    } catch (const Error& e) {
      if (!failure_ || e.code() == ExitCode::kInterrupted) throw;
    }
    if (failure_) std::rethrow_exception(failure_);
    summary_.stages = stages_->results();
    summary_.colmap_seconds = stages_->colmap_seconds();
    summary_.seconds = std::chrono::duration<double>(Clock::now() - start_).count();
    if (summary_.minutes) JudgeMinutes();
    return summary_;
  }

 private:
  using Clock = std::chrono::steady_clock;
  static constexpr const char *kHoldout = "holdout", *kVideo = "video", *kWeb = "web";
  // Seconds for a second of film (960 pixels wide, on two cores, with the frames that it is compared with), and for a
  // page.
  static constexpr double kFilmSecondsASecond = 5, kPageSeconds = 10;

  void ChooseQuality() {
    const int threads = options_.threads > 0 ? options_.threads : ThreadCount();
    const bool given = CamerasAreGiven(options_);
    const int photos = given ? 0 : CountPhotos(options_.input);
    PipelineQuality quality = QualityForMinutes(*options_.minutes, photos, threads);
    if (quality.depth_width_px != 0) quality.depth_width_px.reset();  // it follows from the minutes that are left
    summary_.minutes = KeptMinutes{*options_.minutes, 0, quality.name, 0, {}, true};
    progress_.Message(fmt::format("quality {}: {}", quality.name, InWords(quality, options_, given)));
    if (photos > 0) {
      summary_.minutes->expected_camera_minutes = ExpectedCameraSeconds(quality, photos, threads) / 60;
      progress_.Message(fmt::format("cameras are expected to take about {:.1f} of {:g} minutes",
                                    summary_.minutes->expected_camera_minutes, *options_.minutes));
    }
    options_ = WithQuality(options_, quality, given);
  }

  // What will be done, and about how long it takes where nothing of it was done before.
  void Announce(InputKind kind, bool in_place, bool calibrate) {
    std::vector<std::pair<std::string, double>> stages;  // with expected seconds
    if (calibrate) stages.emplace_back("calibrate", 0);
    const int photos = kind == InputKind::kCapture ? CountPhotos(options_.input) : 0;
    const int threads = options_.threads > 0 ? options_.threads : ThreadCount();
    const double cameras = CamerasAreGiven(options_) ? 0 : ExpectedCameraSeconds(UsualQuality(), photos, threads);
    if (!in_place)
      stages.emplace_back(kind != InputKind::kCapture ? "import"
                          : options_.periodic         ? "timeperiodic"
                                                      : "reconstruct",
                          cameras);
    if (HasSilhouetteSource(options_)) stages.emplace_back("silhouettes", 0);
    const double depth = options_.proxy != "auto" ? 0
                         : options_.proxy_minutes
                             ? 60 * *options_.proxy_minutes
                             : ExpectedDepthSeconds(options_.depth_width_px, photos, threads) / options_.parts;
    if (DepthMapsInParts()) stages.emplace_back("depth-maps", 0);
    stages.emplace_back("proxy", depth);
    if (options_.faces > 0) stages.emplace_back("simplify", 0);
    if (options_.holdout > 0) stages.emplace_back(kHoldout, 0);
    if (options_.video) stages.emplace_back(kVideo, options_.video_seconds * kFilmSecondsASecond);
    if (options_.web) stages.emplace_back(kWeb, kPageSeconds);
    stages.emplace_back("report", 0);
    std::string text;
    double seconds = 0;
    for (const auto& [name, s] : stages) {
      text += (text.empty() ? "" : ", ") + name;
      seconds += s;
    }
    // Of a video nobody knows yet how many frames become photos; of a scene that is there most is done.
    std::error_code error;
    if (photos > 0 && !options_.minutes && !fs::exists(summary_.scene / "report.html", error)) {
      const auto most = std::ranges::max_element(stages, {}, &std::pair<std::string, double>::second);
      text += fmt::format("; {} photos: {} where nothing is there yet", photos,
                          seconds > 60 ? fmt::format("up to about {:.0f} minutes, most of them {},",
                                                     std::ceil(seconds / 60), most->first)
                                       : std::string("about a minute"));
    }
    progress_.Message(fmt::format("{} stages: {}", stages.size(), text));
  }

  // By what the stages took when they did their work: a second run decides as the first did.
  double MinutesLeft() const {
    double seconds = 0;
    for (const StageResult& s : stages_->results()) seconds += s.computed_seconds;
    return *options_.minutes - seconds / 60;
  }

  // Whether `seconds` are left; always, where no minutes were given. Names a stage that is left out.
  bool TimeFor(const std::string& stage, double seconds) {
    if (!options_.minutes || 60 * MinutesLeft() >= seconds) return true;
    progress_.Message(fmt::format("{} is left out: no time is left of {:g} minutes", stage, *options_.minutes));
    summary_.minutes->left_out.push_back(stage);
    stages_->LeaveOut();
    return false;
  }

  void JudgeMinutes() {
    KeptMinutes& kept = *summary_.minutes;
    kept.took = *options_.minutes - MinutesLeft();
    kept.met = kept.took <= kept.asked;
    if (kept.met) return;
    const auto most = std::ranges::max_element(stages_->results(), {}, &StageResult::computed_seconds);
    progress_.Message(fmt::format(
        "{:g} minutes were not kept: {:.1f} were taken, {:.1f} of them by {}; fewer or smaller photos take less",
        kept.asked, kept.took, most->computed_seconds / 60, most->name));
  }

  // What auto may spend on depth maps; no value: as it decides itself.
  std::optional<double> DepthMinutes() const {
    // How long several machines take is not known: parts are as large as auto takes them without a limit.
    if (options_.proxy_minutes || !options_.minutes || options_.parts > 1) return options_.proxy_minutes;
    return DepthMinutesOf(*options_.minutes, MinutesLeft());
  }

  // The first of these names that was a stage.
  const StageResult& StageNamed(const std::set<std::string>& names) const {
    return *std::ranges::find_if(stages_->results(), [&](const StageResult& s) { return names.contains(s.name); });
  }

  void MakeCameras(InputKind kind) {
    if (kind != InputKind::kCapture) {
      stages_->Add(ImportScene({options_.input, summary_.scene, options_.rescale_cameras}, progress_));
      return;
    }
    if (options_.periodic) {
      std::vector<std::string> arguments{"calibrate", options_.input.string(), "-o", summary_.scene.string()};
      if (!options_.fixed_video.empty())
        arguments.insert(arguments.end(), {"--fixed-video", options_.fixed_video.string()});
      if (!options_.period_frames.empty())
        arguments.insert(arguments.end(), {"--period-frames", options_.period_frames});
      // lumi-timeperiodic gives every frame a camera anyway, so that --all-frames is dropped; it refuses options that
      // it does not have.
      for (const std::string& a : options_.reconstruct_arguments)
        if (a != "--all-frames") arguments.push_back(a);
      AddCamera(arguments);
      stages_->Start("timeperiodic", "lumi-timeperiodic", std::move(arguments));
      return;
    }
    std::vector<std::string> arguments{options_.input.string()};
    for (std::size_t i = 1; i < options_.inputs.size(); ++i) arguments.push_back(options_.inputs[i].string());
    arguments.insert(arguments.end(), {"-o", summary_.scene.string()});
    arguments.insert(arguments.end(), options_.reconstruct_arguments.begin(), options_.reconstruct_arguments.end());
    if (options_.rescale_cameras) arguments.emplace_back("--rescale-cameras");
    AddCamera(arguments);
    stages_->Start("reconstruct", "lumi-reconstruct", std::move(arguments));
  }

  // Intrinsics that were calibrated are held.
  void AddCamera(std::vector<std::string>& arguments) const {
    if (!options_.calibration.empty())
      arguments.insert(arguments.end(), {"--camera", (camera_.empty() ? options_.calibration : camera_).string()});
  }

  // Evaluation, film and page do not need each other: as jobs they run at the same time.
  bool AtOnce() const { return options_.executor && !options_.minutes; }
  void StartLast(const RecordedStage& stage) {
    if (AtOnce())
      stages_->LetWait(stage);
    else
      stages_->StartRecorded(stage);
  }

  // What shows a scene may fail: the report is written all the same, and then the run ends with the first failure.
  void OrReport(const std::string& name, const std::function<void()>& make) {
    try {
      make();
    } catch (const Error& e) {
      if (e.code() == ExitCode::kInterrupted) throw;
      if (!failure_) failure_ = std::current_exception();
      progress_.Message(fmt::format("{} failed ({}); the report is written without it", name, e.what()));
      fs::path& made = name == kHoldout ? holdout_folder_ : name == kVideo ? summary_.video : summary_.web;
      made.clear();
      stages_->LeaveOut();
    }
  }

  // A scene that no page can show is a scene all the same.
  void PageOrReason(const std::function<void()>& make) {
    try {
      make();
    } catch (const Error& e) {
      if (e.code() != ExitCode::kDataRefused) throw;
      progress_.Message(fmt::format("no web page: {}", e.what()));
      summary_.web.clear();
      stages_->LeaveOut();
    }
  }

  // read: parts of the scene that count beside those that every picture is made of.
  void StartRender(const std::string& name, const fs::path& output, std::vector<std::string> arguments,
                   std::vector<std::string> read = {}) {
    arguments.insert(arguments.end(), {"--backend", options_.render_backend});
    std::map<std::string, fs::path> inputs;
    read.insert(read.end(), {"lumigraph.json", "sparse", "images", "proxies"});
    for (const std::string& part : read) inputs[part] = summary_.scene / part;
    StartLast({name,
               "lumi-render",
               inputs,
               {output},
               {summary_.scene.string(), "-o", output.string()},
               std::move(arguments)});
  }

  // Runs first, so that the output is checked here as the later stages would check it.
  void Calibrate() {
    std::error_code error;
    RequireOurFolder(summary_.scene, "provenance");
    if (fs::exists(summary_.scene / "truth", error))
      throw UsageError(
          fmt::format("{} is a simulated capture with its truth; it would be overwritten", summary_.scene.string()),
          "choose another output");
    const fs::path folder = summary_.scene / "calibration", report = folder / "report.html";
    const RemoveIfEmpty tidy({folder, summary_.scene / "provenance", summary_.scene});
    // Marks the folder as ours should this run be killed.
    fs::create_directories(summary_.scene / "provenance", error);
    if (error)
      throw MachineError(fmt::format("cannot be made: {}", error.message()), "choose another output", summary_.scene);
    camera_ = folder / "camera.yaml";
    std::vector<std::string> arguments;
    if (!options_.board.empty()) arguments.insert(arguments.end(), {"--board", options_.board});
    if (!options_.square_mm.empty()) arguments.insert(arguments.end(), {"--square-mm", options_.square_mm});
    stages_->StartRecorded({"calibrate",
                            "lumi-calibrate",
                            {{"boards", options_.calibration}},
                            {camera_, report},
                            {options_.calibration.string(), "-o", camera_.string()},
                            std::move(arguments)});
  }

  // What the proxy and the parts of its depth maps have in common.
  std::vector<std::string> ProxyArguments() const {
    std::vector<std::string> arguments{options_.proxy, summary_.scene.string()};
    if (options_.proxy != "auto") return arguments;
    if (options_.holdout > 0)  // it chooses on photos that this N does not report on
      arguments.insert(arguments.end(), {"--holdout", std::to_string(options_.holdout)});
    if (options_.budget_ms) arguments.insert(arguments.end(), {"--budget-ms", fmt::format("{}", *options_.budget_ms)});
    if (const auto width = options_.depth_width_px)
      arguments.insert(arguments.end(), {"--depth-width", std::to_string(*width)});
    else if (const auto minutes = DepthMinutes())
      arguments.insert(arguments.end(), {"--proxy-minutes", fmt::format("{:g}", *minutes)});
    return arguments;
  }

  void MakeProxy() {
    if (DepthMapsInParts())
      stages_->Add(
          MakeDepthMapsInParts({summary_.scene, ProxyArguments(), stages_->WithCommonOptions({}), options_.parts},
                               *options_.executor, progress_));
    std::vector<std::string> arguments = ProxyArguments();
    if (options_.proxy != "auto") arguments.emplace_back("--activate");
    stages_->Start("proxy", "lumi-proxy", std::move(arguments));
  }

  bool DepthMapsInParts() const {
    if (options_.parts <= 1) return false;
    return options_.proxy == "dense" || (options_.proxy == "auto" && options_.proxy_minutes != 0.0);
  }

  void MakeSilhouettes() {
    std::vector<std::string> arguments{"silhouettes", summary_.scene.string()};
    const auto add = [&](const char* option, const std::string& value) {
      if (!value.empty()) arguments.insert(arguments.end(), {option, value});
    };
    add("--rule", options_.silhouette_rule);
    add("--masks", options_.silhouettes.string());
    add("--background", options_.silhouette_background.string());
    // They belong to the photos that were given.
    const fs::path& given = options_.silhouettes.empty() ? options_.silhouette_background : options_.silhouettes;
    if (!given.empty() && ClassifyInput(options_.input) != InputKind::kOurScene && !IsWithin(given, summary_.scene))
      arguments.emplace_back("--undistort");
    stages_->Start("silhouettes", "lumi-proxy", std::move(arguments));
  }

  // The proxy that was made becomes NAME-FACES beside it, and that one is active.
  void Simplify() {
    sibling::MadeProxySummary made{options_.proxy, {}};
    stages_->results().back().summary.Into(made);
    const std::string name = made.name, faces = std::to_string(options_.faces);
    std::vector<std::string> arguments{"simplify",  summary_.scene.string(), "--from",  name,
                                       "--name",    name + "-" + faces,      "--faces", faces,
                                       "--activate"};
    // What is no hull has surroundings, in whose size the things in front are small.
    if (options_.proxy == "hull")
      arguments.emplace_back("--keep-hull");
    else if (!name.starts_with("hull"))
      arguments.emplace_back("--in-pixels");
    stages_->Start("simplify", "lumi-proxy", std::move(arguments));
  }

  void Evaluate(bool in_place) {
    if (!in_place &&
        StageNamed({"reconstruct", "import", "timeperiodic"}).summary.As<sibling::CamerasSummary>().images_registered <
            kFewestPhotosForHoldout) {
      progress_.Message(fmt::format("fewer than {} photos have a camera: none is held out for an evaluation",
                                    kFewestPhotosForHoldout));
      stages_->LeaveOut();
      return;
    }
    holdout_folder_ = summary_.scene / "holdout";
    StartRender(kHoldout, holdout_folder_,
                {"--holdout", options_.holdout_each ? "each" : std::to_string(options_.holdout)});
  }

  void MakeVideo() {
    summary_.video = summary_.scene / "fly-through.mp4";
    std::vector<std::string> arguments{"--width", std::to_string(options_.video_width_px), "--seconds",
                                       fmt::format("{}", options_.video_seconds)};
    if (options_.video_fidelity_db > 0)
      arguments.insert(arguments.end(), {"--fidelity-db", fmt::format("{}", options_.video_fidelity_db)});
    if (options_.video_fill) arguments.insert(arguments.end(), {"--border", "fill"});
    // Fronts measured since the film was made choose other samples.
    StartRender(kVideo, summary_.video, std::move(arguments), {"fronts"});
  }

  void MakeWebPage() {
    summary_.web = summary_.scene / "web.html";
    std::map<std::string, fs::path> inputs;
    for (const char* part : {"lumigraph.json", "sparse", "images", "proxies"}) inputs[part] = summary_.scene / part;
    PageOrReason([&] {
      StartLast({kWeb,
                 "lumi-export",
                 inputs,
                 {summary_.web},
                 {"web", summary_.scene.string(), "-o", summary_.web.string()},
                 {"--max-mb", fmt::format("{}", options_.web_mb)}});
    });
  }

  // Of the stages before the report.
  double AroundColmapSeconds() const {
    double seconds = 0;
    for (const StageResult& s : stages_->results())
      if (std::set<std::string>{"reconstruct", "timeperiodic", "import", "silhouettes", "depth-maps", "proxy",
                                "simplify"}
              .contains(s.name))
        seconds += s.computed_seconds;
    return std::max(0.0, seconds - stages_->colmap_seconds());
  }

  void Report() {
    const auto start = Clock::now();
    summary_.around_colmap_seconds = AroundColmapSeconds();
    ReportInput input{
        summary_.scene,  options_.input, stages_->results(), stages_->colmap_seconds(), summary_.around_colmap_seconds,
        holdout_folder_, summary_.video, summary_.web};
    StageResult stage;
    stage.name = "report";

    Provenance wanted;
    wanted.stage = "report";
    wanted.version = kVersion;
    wanted.options["source"] = options_.input.string();
    for (const StageResult& s : stages_->results()) wanted.options["stage " + s.name] = WithoutReuse(s);
    for (const char* part : {"lumigraph.json", "fronts", "tradeoff"})
      wanted.inputs[part] = Fingerprint(summary_.scene / part);
    // For a scene that is one of several qualities (price.h).
    wanted.inputs["../tradeoff/pipeline.json"] = Fingerprint(summary_.scene / ".." / "tradeoff" / "pipeline.json");
    summary_.report = summary_.scene / "report.html";
    summary_.contact_sheet = summary_.scene / "contact-sheet.jpg";
    stage.reused = IsUpToDate(summary_.scene, wanted);
    if (!stage.reused) {
      const ReportFiles files = WriteReport(input, progress_);
      summary_.contact_sheet = files.contact_sheet;
      for (const fs::path& file : {files.html, files.json, files.contact_sheet})
        if (!file.empty()) wanted.outputs[file.filename().string()] = Fingerprint(file);
      wanted.seconds = std::chrono::duration<double>(Clock::now() - start).count();
      const FolderLock lock(summary_.scene);
      WriteProvenance(summary_.scene, wanted);
    }
    stage.seconds = std::chrono::duration<double>(Clock::now() - start).count();
    stages_->Add(std::move(stage));
    summary_.around_colmap_seconds += stages_->results().back().computed_seconds;
  }

  // A summary without what differs between a run and its reuse.
  static std::string WithoutReuse(const StageResult& stage) {
    JsonKeys rest;
    rest.Append(stage.summary);
    for (const char* key : {"reused", "seconds", "colmap_seconds"}) rest.Remove(key);
    return rest.Text();
  }

  PipelineOptions options_;
  ProgressSink& progress_;
  const Clock::time_point start_;
  PipelineSummary summary_;
  std::optional<StageRunner> stages_;  // once it is known where the scene goes
  fs::path holdout_folder_;
  std::exception_ptr failure_;  // the first of a stage without which there is a scene, and a report
  fs::path camera_;             // what lumi-calibrate found; empty: not asked for
};

}  // namespace

PipelineSummary RunPipeline(const PipelineOptions& options, ProgressSink& progress) {
  if (const std::string wrong = Validate(options); !wrong.empty()) throw UsageError(wrong);
  return Run(options, progress).Go();
}

}  // namespace lumi
