// The viewer between its window and its picture: one object a run. viewer_app.cc is its frame; viewer_arrivals.cc takes photos and
// proxies, viewer_input.cc steers, viewer_path.cc keeps the camera path, records and measures, viewer_refine.cc refines the picture
// at rest, viewer_show.cc draws heat maps and differences, viewer_script.cc runs scripts.
#pragma once

#include <algorithm>
#include <chrono>
#include <deque>
#include <filesystem>
#include <future>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "render/effects/exposure.h"
#include "render/gl/gl_lumigraph.h"
#include "render/viewer/error_probe.h"
#include "render/viewer/flat_surface.h"
#include "render/viewer/frame_painter.h"
#include "render/viewer/motion_budget.h"
#include "render/viewer/navigation.h"
#include "render/viewer/opening.h"
#include "render/viewer/overlay.h"
#include "render/viewer/panel.h"
#include "render/viewer/photo_loader.h"
#include "render/viewer/picture_texture.h"
#include "render/viewer/recorder.h"
#include "render/viewer/refiner.h"
#include "render/viewer/script.h"
#include "render/viewer/strip_painter.h"
#include "render/viewer/viewer.h"
#include "render/viewer/window.h"
#include "scene/files/scene_folder.h"
#include "scene/program/error.h"
#include "scene/program/parallel.h"
#include "scene/program/stopwatch.h"

namespace lumi {

using Clock = std::chrono::steady_clock;
constexpr double kMb = 1e6;
constexpr double kMessage_s = 4.0;

inline bool Same(const RenderRequest& a, const RenderRequest& b) {
  return a.view.P == b.view.P && a.view.size_px == b.view.size_px && a.show == b.show && a.settings == b.settings;
}

class Viewer {
 public:
  Viewer(const ViewerOptions& options, Window& window, Opened& opened, ProgressSink& progress, std::vector<ScriptStep> script);

  nlohmann::json Run();

 private:
  // A path's video in the making.
  struct PathRecording {
    std::unique_ptr<Recorder> recorder;
    StripPainter painter;
    CameraPath path;
    RenderRequest request;     // but for the camera
    Eigen::Vector2i size_px = {0, 0};
    int next = 0;              // frame to draw
  };
  // A video of what is seen.
  struct LiveRecording {
    std::unique_ptr<Recorder> recorder;
    Clock::time_point start;
    Eigen::Vector2i size_px = {0, 0};
  };

  ViewId StartView() const {
    return {options_.view.empty() ? static_cast<int>(scene_.views.size()) / 2 : FindView(scene_, options_.view)};
  }
  int LargestSide() const {
    int side = 1;
    for (const View& v : scene_.views) side = std::max({side, scene_.CameraOf(v).width_px, scene_.CameraOf(v).height_px});
    return side;
  }
  void Say(const std::string& message) {
    facts_.message = message;
    message_until_ = Clock::now() + std::chrono::milliseconds(static_cast<int>(1000 * kMessage_s));
  }
  // A failure that the window survives: shown, and in a script the end.
  void Complain(const Error& e) {
    if (scripted_) throw;
    Say(e.file().empty() ? std::string(e.what()) : e.file().filename().string() + ": " + e.what());
  }

  void SetProxy(PreparedProxy proxy);
  void TakePhotos();
  void TakeProxy();
  void WishProxy(const std::string& name);
  void KeepForExposure(ViewId view, const Photo& photo);
  void TakeExposures();
  bool Steer(const WindowInput& input, double dt_s);
  void Key(int key);
  void Jump(int view, bool at_once);
  Eigen::Vector3d Pivot();
  std::optional<Eigen::Vector3d> PointAt(double x_px, double y_px) const;
  void Grant(const PanelWishes& wishes);

  RenderRequest Request(const Eigen::Vector2i& size_px, const RadianceSettings& settings) const;
  bool Paint();                  // returns whether the picture changed
  void KeepBudget();
  void StepBudgetProbe();
  nlohmann::json Summary(long frames);
  void Compose();
  void DrawPath(const Overlay::Eye& eye);
  void Screenshot(const std::filesystem::path& file, bool with_ui);
  std::filesystem::path FreeScreenshotName() const;
  bool Loading() const { return loader_.outstanding() > 0 || new_photos_; }
  bool Settled() const { return !Loading() && !exposing_.valid() && !exposures_wanted_; }  // nothing changes by itself
  bool Working() const { return probe_.busy() || path_recording_ || live_recording_; }

  // viewer_refine.cc: optimal weights at rest.
  RadianceSettings Drawn() const;
  std::optional<RenderRequest> WantedRefinement() const;
  void StepRefinement(bool changed, bool moving);
  bool RefinementOpen() const;   // there will be another picture at rest
  bool KeepPhotos();             // for it; returns whether all are there
  void StopRefining();
  nlohmann::json RefinementSummary() const;

  // viewer_show.cc: heat maps, and the difference to a photo.
  struct HeatRequest {
    RenderRequest request;
    Measure measure = Measure::kWeight;
  };
  void StepHeatMap();
  bool HeatIsShown(const HeatRequest& wanted) const;
  bool HeatOpen() const;
  void ShowDifference(const Image8& difference);

  // viewer_path.cc: the camera path, time, recording, measuring.
  PathKey CurrentKey(double time_s) const;
  ViewState StateOfKey(const PathKey& key) const;
  void AddKey(std::optional<double> time_s);
  void JumpToKey(int index);
  std::size_t KeyCalled(double index) const;   // throws UsageError
  void PathEdited();
  void LoadPath(const std::filesystem::path& file);
  void SavePath(const std::filesystem::path& file, bool nerfstudio);
  void StartPlaying();
  bool Play(double dt_s);        // path and time go on; returns whether the picture changes
  void StartRecording(const std::filesystem::path& wanted);
  void StartLiveRecording(const std::filesystem::path& wanted);
  void FinishRecording();
  void CancelRecording();
  void StepLiveRecording();
  void StepJobs();
  void StepPathRecording(double step_ms, bool undisturbed);
  void CloseRecording(const Recorder& recorder);
  void StartMeasuring();
  std::filesystem::path VideoName() const;

  void RunScript();
  bool RunStatement(const ScriptStep& s);   // false: it waits
  void AfterPainting();

  const ViewerOptions& options_;
  Window& window_;
  Lumigraph& lumigraph_;
  const Scene& scene_;
  ProgressSink& progress_;
  PhotoBudget budget_;
  GlLumigraph gl_;
  FramePainter painter_;
  Overlay overlay_;
  ViewState home_;
  Navigator navigator_;
  PhotoLoader loader_;
  std::future<PreparedProxy> proxy_loading_;
  EffectChoice effects_;
  std::set<std::string> decided_;               // effects that the user spoke about
  std::vector<Photo> small_photos_;             // until exposures are known
  std::future<Exposures> exposing_;
  bool exposures_wanted_ = true;
  ViewerSettings settings_;
  PanelFacts facts_;
  Clock::time_point message_until_ = Clock::now();

  RadianceSettings accepted_;                   // that were drawn last
  RadianceSettings cost_settings_;              // that facts_.picture_ms belongs to
  std::optional<RadianceSettings> refused_;     // that the backend does not do
  std::string refusal_;

  MotionBudget motion_;
  StripPainter motion_probe_;
  bool motion_probe_warm_ = false;              // the setting was drawn once: its shaders are compiled

  // Of the picture at rest: constant once the refiner has them, replaced, never changed.
  std::shared_ptr<std::vector<Photo>> photos_;
  bool photos_missing_ = false;                 // they came while nobody wanted them
  std::unique_ptr<PhotoLoader> photos_reader_;
  std::shared_ptr<const ProxyTracer> proxy_tracer_;
  Refiner refiner_;
  PictureTexture refined_;                      // empty: what painter_ draws is shown
  std::optional<RenderRequest> refinement_wanted_;
  long refinement_generation_ = -1;
  bool refinement_ended_ = false;               // it is shown, or there is none
  Clock::time_point resting_since_ = Clock::now();
  long refinements_ = 0, refinements_cancelled_ = 0;
  double refinement_s_ = 0;
  std::string refinement_problem_;

  FlatSurface flat_;
  PictureTexture heat_, difference_;            // empty: there is none
  std::future<MeasureMap> heat_drawing_;
  std::optional<HeatRequest> heat_wanted_, heat_drawn_;
  long heat_wanted_generation_ = -1, heat_drawn_generation_ = -1;
  Clock::time_point heat_begun_ = Clock::now();

  CameraPath path_;
  std::optional<double> playing_s_;             // since the path's first key
  ErrorProbe probe_;
  std::vector<MeasuredError> errors_;
  std::unique_ptr<PathRecording> path_recording_;
  std::unique_ptr<LiveRecording> live_recording_;
  Clock::time_point last_step_ = Clock::now();
  std::vector<std::pair<std::string, long>> videos_;

  std::optional<Eigen::Vector3d> pivot_;        // picked by the user
  std::optional<Eigen::Vector3d> drag_pivot_;   // of the drag that goes on
  int current_photo_ = -1;                      // jumped to last
  bool new_photos_ = false;
  Clock::time_point last_refresh_ = Clock::now() - std::chrono::hours(1);
  long generation_ = 0;                         // of photos and proxy

  Eigen::Vector2i size_px_ = {1, 1};
  std::optional<RenderRequest> drawn_;
  long drawn_generation_ = -1;

  std::deque<ScriptStep> script_;
  bool scripted_;
  Clock::time_point waiting_since_ = Clock::now();
  bool waiting_ = false;
  std::vector<std::string> screenshots_;
  std::vector<double> frame_ms_;
};

}  // namespace lumi
