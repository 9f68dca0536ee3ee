// The viewer with a free camera. viewer_app.cc draws a frame; viewer_photos.cc takes photos, viewer_arrivals.cc what
// else comes from other threads; viewer_input.cc handles input, viewer_path.cc keeps the camera path, viewer_jobs.cc
// records and measures, viewer_refine.cc refines the picture at rest, viewer_show.cc draws heat maps and differences,
// viewer_script.cc runs a script's statements.
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <filesystem>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "render/gl/gl_lumigraph.h"
#include "render/gl/hole_fill.h"
#include "render/viewer/error_probe.h"
#include "render/viewer/flat_surface.h"
#include "render/viewer/frame_painter.h"
#include "render/viewer/motion_budget.h"
#include "render/viewer/navigation.h"
#include "render/viewer/opening.h"
#include "render/viewer/page_export.h"
#include "render/viewer/panel.h"
#include "render/viewer/photo_loader.h"
#include "render/viewer/picture_texture.h"
#include "render/viewer/recorder.h"
#include "render/viewer/refiner.h"
#include "render/viewer/strip_painter.h"
#include "render/viewer/view_session.h"
#include "scene/files/scene_folder.h"
#include "scene/program/error.h"
#include "scene/program/parallel.h"

namespace lumi {

constexpr double kMb = 1e6;

inline bool Same(const RenderRequest& a, const RenderRequest& b) {
  return a.view.P == b.view.P && a.view.size_px == b.view.size_px && a.show == b.show && a.settings == b.settings;
}

class Viewer final : public ViewSession {
 public:
  Viewer(const ViewerOptions& options, Window& window, Opened& opened, ProgressSink& progress,
         const std::vector<ScriptStep>& script);
  ~Viewer() override;

 private:
  // A path's video in the making.
  struct PathRecording {
    std::unique_ptr<Recorder> recorder;
    StripPainter painter;
    CameraPath path;
    RenderRequest request;  // without the camera
    Eigen::Vector2i size_px = {0, 0};
    int next = 0;       // frame to draw
    bool fill = false;  // holes, as in the window when it was begun
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
  // Reports a failure that the window survives; with a script, it is thrown again and ends the viewer.
  void Complain(const Error& e) {
    if (script_.given) throw;
    Say(e.file().empty() ? std::string(e.what()) : e.file().filename().string() + ": " + e.what());
  }

  void SetProxy(PreparedProxy proxy);
  // viewer_photos.cc
  std::vector<Eigen::Vector2i> PhotoSizes() const;
  std::size_t RoomForPhotos(const VisibilityMaps& maps) const;
  bool OnDemand() const { return gl_.slots() != nullptr; }  // photos come and go: not all fit into graphics memory
  int SmallHalvings() const;
  void TakeSmallCopies();
  void ReadAll();
  void AskForPhotos();
  void AskForMissing();
  void WantOnDemand(const RenderRequest& request, const RenderRequest* ahead);
  std::optional<RenderRequest> RequestAhead(const RenderRequest& now) const;
  bool PhotosAreHere(const RenderRequest& request);
  void TakePhotos();
  void Keep(PhotoLoader::Loaded loaded);
  void KeepForExposure(ViewId view, const Photo& photo);
  int PhotosOpen() const;  // that the picture waits for
  RadianceSettings SettingsToAskFor() const;
  bool HalfDrawn() const;
  bool CopiesReady() const;
  bool AskedForThis() const;  // the photos of the view as it is now were asked for

  void TakeProxy();
  void WishProxy(const std::string& name);
  void TakeEstimates();
  void ReadCorrected();
  Sources SourcesAsDrawn() const;
  std::unique_ptr<PhotoLoader> NewLoader() const {
    return std::make_unique<PhotoLoader>(scene_, std::clamp(ThreadCount() - 1, 1, 6));
  }
  bool Move(const WindowInput& input, double dt_s);
  void Key(int key);
  void Jump(int view, bool at_once);
  Eigen::Vector3d Pivot();
  std::optional<Eigen::Vector3d> PointAt(double x_px, double y_px) const;
  void Grant(const PanelWishes& wishes);

  // viewer_app.cc: a frame.
  void Steer(const WindowInput& input, double dt_s) override;
  bool RunStatement(const ScriptStep& s) override;
  void Paint() override;
  void DrawPanels() override;
  void Compose() override;
  void AfterComposing() override { StepLiveRecording(); }
  double Wait_s() const override;
  bool painted() const override { return painter_.painted(); }
  bool with_photos() const override { return facts_.photos_loaded > 0 || arriving_.small_copies; }
  bool AtRest() const override;
  bool ReadyForScreenshot() const override {
    return painter_.complete() && !(Settled() && (RefinementOpen() || HeatOpen()));
  }
  bool panel() const override { return settings_.panel; }
  void Summarise(JsonKeys& j) override;
  void End() override;
  RenderRequest Request(const Eigen::Vector2i& size_px, const RadianceSettings& settings) const;
  bool PaintPicture();  // returns whether it changed
  void KeepBudget();
  void StepBudgetProbe();
  void KeepFacts();
  void DrawPath(const Overlay::Eye& eye);
  std::filesystem::path FreeScreenshotName() const;
  bool Loading() const { return PhotosOpen() > 0 || arriving_.new_photos; }
  bool Settled() const {
    return !Loading() && AskedForThis() && !arriving_.estimates.valid() && !arriving_.estimates_wanted;
  }  // nothing changes by itself
  bool Working() const { return jobs_.probe.busy() || jobs_.path_recording || jobs_.live_recording; }

  // viewer_refine.cc: optimal weights at rest.
  RadianceSettings Drawn() const;
  std::optional<RenderRequest> WantedRefinement() const;
  void StepRefinement(bool changed, bool moving);
  bool RefinementOpen() const;                   // there will be another picture at rest
  bool KeepPhotos(const RenderRequest& wanted);  // for refinement; returns whether all are loaded
  void KeepPhotosOf(const RenderRequest& wanted);
  void StopRefining();
  JsonKeys RefinementSummary() const;

  // viewer_show.cc: heat maps, holes that are filled, and the difference to a photo.
  struct HeatRequest {
    RenderRequest request;
    Measure measure;
  };
  void StepHeatMap();
  bool HeatIsShown(const HeatRequest& wanted) const;
  bool HeatOpen() const;
  void StepColorLegend();
  bool ColorLegendOpen() const;
  void FillHoles();
  void ShowDifference(const Image8& difference);

  // viewer_scale.cc: two marks, and the metres between them.
  void Mark(const Eigen::Vector2d& x_px);  // what the proxy shows at a pixel of the window
  void SetScale(double metres);            // throws UsageError
  void DrawMarks() const;

  // viewer_path.cc: the camera path, and time.
  PathKey CurrentKey(double time_s) const;
  ViewState StateOfKey(const PathKey& key) const;
  void AddKey(std::optional<double> time_s);
  void JumpToKey(int index);
  std::size_t KeyCalled(double index) const;  // throws UsageError
  void PathEdited();
  void LoadPath(const std::filesystem::path& file);
  void SavePath(const std::filesystem::path& file, bool nerfstudio);
  void StartPlaying();
  bool Play(double dt_s);  // path and time go on; returns whether the picture changes
  // viewer_jobs.cc: recording, measuring.
  void StartRecording(const std::filesystem::path& wanted);
  void StartLiveRecording(const std::filesystem::path& wanted);
  void FinishRecording();
  void CancelRecording();
  void StepLiveRecording();
  void StepJobs();
  void StepPathRecording(double step_ms, bool undisturbed);
  void CloseRecording(const Recorder& recorder);
  void StartMeasuring();
  std::filesystem::path PageName() const;
  std::string EffectsOfPage() const;
  void StartExport(const std::filesystem::path& file);
  void StepExport();
  std::filesystem::path VideoName() const;

  void RunPathStatement(const ScriptStep& s);  // of the camera path's keys and files
  bool RunRecordingStatement(const ScriptStep& s);

  // What comes from other threads.
  struct Arrivals {
    std::unique_ptr<PhotoLoader> loader = {};
    std::vector<bool> open = {};    // photos that are still to be read, where all are held
    std::vector<bool> needed = {};  // on demand: photos that the picture asked for last is blended from, ...
    int needed_open = 0;            // ... and how many of them are still to come
    // Small copies of all photos, on their way into graphics memory; whether all are there.
    std::atomic<bool> stop_copies = false;
    std::future<std::vector<Photo>> reading_copies = {};
    std::vector<Photo> copies = {};
    std::size_t copies_taken = 0;
    bool small_copies = false;
    std::optional<RenderView> asked_view = {};  // that photos were asked for last
    RadianceSettings asked_settings = {};
    Clock::time_point asked = {};
    std::vector<Photo> small_photos = {};  // until exposures are known; none on demand
    std::future<PhotoEstimates> estimates = {};
    std::optional<PhotoEstimates> estimated = {};  // the result of `estimates`
    // The gain that each photo is currently drawn with, while all are read again with other corrections; else empty.
    std::vector<double> gains = {};
    bool estimates_wanted = true;
    std::future<PreparedProxy> proxy = {};
    bool new_photos = false;
    Clock::time_point last_refresh = Clock::now() - std::chrono::hours(1);
  };
  struct Steering {
    ViewState home;
    Navigator navigator;
    std::optional<Eigen::Vector3d> pivot = {};       // picked by the user
    std::optional<Eigen::Vector3d> drag_pivot = {};  // of the drag that goes on
    int current_photo = -1;                          // jumped to last
    bool moving = false;                             // the camera will have moved by the next picture
  };
  // The last picture that was drawn, and settings that could not be drawn.
  struct LastPicture {
    std::optional<RenderRequest> request = {};
    long generation = -1;
    bool changed = false;  // since the frame before
    RadianceSettings settings = {};
    RadianceSettings cost_settings = {};           // settings of facts_.picture_ms
    std::optional<RadianceSettings> refused = {};  // settings that the backend does not support
    std::string refusal = {};
  };
  struct Moving {
    MotionBudget budget = {};
    StripPainter probe;
    bool probe_warm = false;  // the setting was drawn once: its shaders are compiled
  };
  // The picture at rest. The photos given to the refiner are never changed, only replaced.
  struct Rest {
    std::shared_ptr<std::vector<Photo>> photos = {};
    bool photos_missing = false;               // photos arrived while refinement was off, and were not kept
    std::optional<RenderView> photos_of = {};  // on demand: the view whose photos are kept, ...
    RadianceSettings photos_settings = {};
    std::vector<int> halvings = {};  // of each
    std::size_t photo_bytes = 0;     // ... as far as they fit into this
    std::unique_ptr<PhotoLoader> photos_reader = {};
    Refiner refiner = {};
    PictureTexture picture = {};  // empty: what painter_ draws is shown
    std::optional<RenderRequest> wanted = {};
    long generation = -1;
    bool ended = false;  // the refined picture is shown, or failed
    Clock::time_point since = Clock::now();
    long pictures = 0, cancelled = 0;
    double seconds = 0;
    std::string problem = {};
  };
  struct HeatMaps {
    PictureTexture picture = {};  // empty: there is none
    std::future<MeasureMap> drawing = {};
    std::optional<HeatRequest> wanted, drawn = {};
    long wanted_generation = -1, drawn_generation = -1;
    Clock::time_point begun = Clock::now();
  };
  // Shares of the photos in the false colours that are shown.
  struct ColorLegend {
    std::future<std::vector<double>> counting = {};
    std::optional<RenderRequest> wanted = {}, counted = {};
    long generation = -1;
  };
  // The picture that is shown, its holes filled.
  struct Filled {
    GlHoleFill picture;
    bool shown = false;
    unsigned of_texture = 0;  // texture that was filled, ...
    long of_refined = 0;      // ... and the number of the refined picture in it
    Eigen::Vector2i of_size_px = {0, 0};
  };
  // Recording, measuring and exporting.
  struct Jobs {
    ErrorProbe probe;
    PictureTexture difference = {};
    std::unique_ptr<PathRecording> path_recording = {};
    std::unique_ptr<LiveRecording> live_recording = {};
    std::vector<Video> videos = {};
    std::unique_ptr<PageExport> page_export = {};
    Clock::time_point last_step = Clock::now();
  };

  const ViewerOptions& options_;
  Lumigraph& lumigraph_;
  const Scene& scene_;
  ProgressSink& progress_;
  EffectChoice effects_;    // as the data call for them
  Decided decided_;         // effects that the user decided
  std::size_t photo_room_;  // bytes of memory for photos
  int small_halvings_;      // of small copies of all photos; -1: there are none
  GlLumigraph gl_;
  FramePainter painter_;
  std::shared_ptr<const ProxyTracer> proxy_tracer_;
  long generation_ = 0;  // of photos and proxy
  FlatSurface flat_;
  ViewerSettings settings_;
  PanelFacts facts_;
  CameraPath path_;
  std::optional<double> playing_s_;  // since the path's first key
  Arrivals arriving_;
  Eigen::Vector2d cursor_px_ = Eigen::Vector2d::Zero();
  Steering steering_;
  LastPicture drawn_;
  Moving moving_;
  Rest rest_;
  HeatMaps heat_;
  ColorLegend color_legend_;
  Filled filled_;
  Jobs jobs_;
};

}  // namespace lumi
