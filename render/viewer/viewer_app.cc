// The viewer's frame: what is drawn, composed, and how long to wait for the next.
#include "render/viewer/viewer_app.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <thread>

#include "render/radiance/setting_options.h"
#include "render/settings_json.h"
#include "scene/files/scene_folder.h"
#include "scene/model/orientation.h"
#include "scene/program/error.h"

namespace lumi {
namespace {

constexpr double kIdleWait_s = 0.2;      // between frames when nothing happens
constexpr double kLoadingWait_s = 0.02;  // leaves the cores to the photos
constexpr double kRefiningWait_s = 0.1;  // leaves the cores to the refined picture
constexpr double kFirstHelp_s = 20;
constexpr double kSmoothing = 0.1;     // of times that are shown
constexpr std::size_t kRestShare = 5;  // one in so many bytes for photos is for those of the picture at rest

}  // namespace

Viewer::Viewer(const ViewerOptions& options, Window& window, Opened& opened, ProgressSink& progress,
               const std::vector<ScriptStep>& script)
    : ViewSession(window, script),
      options_(options),
      lumigraph_(opened.lumigraph),
      scene_(lumigraph_.scene()),
      progress_(progress),
      effects_(opened.effects),
      decided_(options.decided),
      photo_room_(RoomForPhotos(*opened.proxy.visibility)),
      small_halvings_(SmallHalvings()),
      gl_(MakeSources(scene_), PhotoSizes(), photo_room_ - photo_room_ / kRestShare, small_halvings_),
      painter_(gl_, PainterOptions{}),
      path_(opened.path),
      steering_{StateOfView(scene_, StartView()),
                Navigator(StateOfView(scene_, StartView()), scene_.up, 1.0 / scene_.normalized_from_world.scale)},
      moving_{{}, StripPainter(gl_)},
      rest_{std::make_shared<std::vector<Photo>>(scene_.views.size())},
      jobs_{ErrorProbe(scene_, gl_)} {
  RadianceSettings& s = settings_.radiance;
  s = lumigraph_.settings();
  std::vector<double> times;
  for (const View& v : scene_.views)
    if (v.time_s) times.push_back(*v.time_s);
  if (!times.empty())
    facts_.times = {*std::min_element(times.begin(), times.end()), *std::max_element(times.begin(), times.end())};
  facts_.period_s = s.period_s;
  facts_.metres_per_unit = scene_.metres_per_unit;
  if (options.effects == "auto") ApplyEffects(effects_, decided_, s);
  // A moment that the user names switches the time measure on.
  if (!times.empty() && options.effects == "auto" && (options.phase || decided_.Has("time-s"))) s.time = true;
  settings_.panel = options.show_ui && options.panel;
  settings_.budget_ms = options.budget_ms;
  settings_.refine = options.refine;
  SetProxy(std::move(opened.proxy));
  size_px_ = window.FramebufferSize().cwiseMax(1);
  rest_.photo_bytes = photo_room_ / kRestShare;
  if (!OnDemand()) arriving_.small_photos.resize(scene_.views.size());
  ReadAll();
  for (const View& v : scene_.views) facts_.photo_names.push_back(v.name);
  facts_.scene = NameOfFolder(options.scene);
  if (facts_.scene.empty()) facts_.scene = "lumigraph";
  facts_.device = GlDeviceName();
  facts_.photos_total = static_cast<int>(scene_.views.size());
  facts_.budget_mb = options.memory_mb;
  facts_.on_demand = OnDemand();
  facts_.proxies = ListProxies(scene_.folder);
  facts_.effects = effects_.effects;
  PathEdited();
  if (!script_.given)
    Say("drag: orbit; right drag: look around; wheel: nearer; W A S D: fly; H: all keys; drop a folder: open it",
        kFirstHelp_s);
}

RenderRequest Viewer::Request(const Eigen::Vector2i& size_px, const RadianceSettings& settings) const {
  RenderRequest r;
  r.view = MakeWindowView(steering_.navigator.state(), size_px.x(), size_px.y());
  r.settings = settings;
  // Corrected photos have lost brightness, which exposure restores.
  r.settings.exposure |= lumigraph_.corrections().Any() || !arriving_.gains.empty();
  r.show = settings_.seen.show == Show::kTessellation && !settings.Sparse() ? Show::kColor : settings_.seen.show;
  return r;
}

// Invalid settings are not tried; for settings that the backend does not support, the earlier ones are drawn.
bool Viewer::PaintPicture() {
  const RadianceSettings asked = Drawn();
  const std::string problem = Validate(asked);
  const bool usable = problem.empty() && !(drawn_.refused && *drawn_.refused == asked);
  if (usable) drawn_.refused.reset();
  facts_.problem = !problem.empty() ? problem : drawn_.refused ? drawn_.refusal : "";
  const bool may_refine = !Loading() && !jobs_.path_recording && !jobs_.probe.drawing();
  for (RadianceSettings wanted = usable ? asked : drawn_.settings;;) {
    const RenderRequest request = Request(size_px_, wanted);
    const bool moved = !drawn_.request || drawn_.request->view.P != request.view.P;
    const bool changed = !drawn_.request || !Same(*drawn_.request, request) || drawn_.generation != generation_;
    const RadianceSettings quick =
        moving_.budget.active()
            ? moving_.budget.Next(std::chrono::duration<double>(Clock::now().time_since_epoch()).count(), moved, wanted)
            : wanted;
    try {
      painter_.Paint(request, Request(painter_.PreviewSize(size_px_), quick), changed, may_refine);
    } catch (const UsageError& e) {
      if (!(quick == wanted)) {
        moving_.budget.End();
        settings_.budget_ms = 0;
        Say(e.what());
        continue;
      }
      // If even the earlier settings fail, falls back to the defaults, which every backend supports.
      if (wanted == RadianceSettings{}) throw;
      drawn_.refusal = e.what();
      if (!e.hint().empty()) drawn_.refusal += ": " + e.hint();
      facts_.problem = drawn_.refusal;
      if (wanted == drawn_.settings || painter_.empty()) drawn_.settings = {};
      if (wanted == asked) drawn_.refused = wanted;
      wanted = drawn_.settings;
      continue;
    }
    if (painter_.preview_ms() > 0) moving_.budget.Measured(painter_.preview_ms());
    drawn_.settings = wanted;
    drawn_.request = request;
    drawn_.generation = generation_;
    return changed;
  }
}

// Starts or ends holding a frame time, as the settings say.
void Viewer::KeepBudget() {
  if (settings_.budget_ms > 0) {
    if (settings_.budget_ms != moving_.budget.budget_ms())
      moving_.budget.Begin(settings_.budget_ms, scene_.folder,
                           {facts_.proxy, "gl", facts_.device, size_px_.x(), size_px_.y()}, settings_.radiance);
  } else if (moving_.budget.active()) {
    moving_.budget.End();
    moving_.probe.Cancel();
  }
  painter_.SetMovingTime(moving_.budget.active() ? moving_.budget.budget_ms() : PainterOptions{}.moving_ms);
  facts_.budget_now = moving_.budget.ToProbe() != nullptr ? "measuring what settings cost ..." : moving_.budget.name();
}

// Probes one setting after another at the moving picture's size, twice each, because the first frame includes compiling
// shaders.
void Viewer::StepBudgetProbe() {
  const RadianceSettings* wanted = moving_.budget.ToProbe();
  if (wanted == nullptr || !Settled()) return;
  const Eigen::Vector2i size = painter_.PreviewSize(size_px_);
  try {
    moving_.probe.Start(Request(size, *wanted));
    painter_.Disturbed();
    moving_.probe.Step(0, false);
  } catch (const UsageError&) {
    moving_.probe_warm = false;
    return moving_.budget.Probed(std::nullopt);
  }
  if (moving_.probe_warm)
    moving_.budget.Probed(moving_.probe.picture_ms() * static_cast<double>(size_px_.prod()) /
                          static_cast<double>(size.prod()));
  moving_.probe_warm = !moving_.probe_warm;
}

// The picture and what is over it, without the panel, into the bound framebuffer.
void Viewer::Compose() {
  if (painter_.empty()) return overlay_.PresentNothing(size_px_);
  const RenderView view =
      Normalized(MakeWindowView(steering_.navigator.state(), size_px_.x(), size_px_.y()), scene_.normalized_from_world);
  if (settings_.seen.flat) {
    flat_.Draw(view, gl_);
    overlay_.Present(flat_, size_px_);
  } else if (settings_.seen.measure && !heat_.picture.empty()) {
    overlay_.Present(heat_.picture, size_px_);
  } else if (filled_.shown) {
    overlay_.Present(filled_.picture, size_px_);
  } else if (rest_.picture.empty()) {
    overlay_.Present(painter_.shown(), painter_.shown_size_px(), size_px_);
  } else {
    overlay_.Present(rest_.picture, size_px_);
  }
  const bool with_path = settings_.path && !path_.keys.empty() && !playing_s_;
  if (!settings_.frusta && !settings_.mesh && !with_path) return;
  const Overlay::Eye eye{view, &painter_.shown(), painter_.shown_size_px(), size_px_};
  if (settings_.mesh) overlay_.ProxyEdges(eye, gl_);
  if (with_path) DrawPath(eye);
  if (settings_.frusta) {
    std::vector<Eigen::Vector4f> colors;
    std::vector<int> quarter_turns;
    for (std::size_t j = 0; j < scene_.views.size(); ++j) {
      quarter_turns.push_back(QuarterTurns(scene_.views[j].orientation));
      const Eigen::Vector3f c = SourceColor(static_cast<int>(j));
      const bool nearest = static_cast<int>(j) == facts_.nearest_photo;
      colors.emplace_back(nearest ? Eigen::Vector4f(1, 1, 1, 1)
                                  : Eigen::Vector4f(c.x(), c.y(), c.z(), gl_.Has({static_cast<int>(j)}) ? 0.9F : 0.3F));
    }
    constexpr double kFrustumDepth = 0.08;  // normalised: the scene's size is about 1
    overlay_.Frusta(eye, gl_.sources(), colors, quarter_turns, kFrustumDepth);
  }
}

std::filesystem::path Viewer::FreeScreenshotName() const {
  for (int i = 1;; ++i) {
    const std::filesystem::path name = fmt::format("{}-{:03d}.png", facts_.scene, i);
    if (!std::filesystem::exists(name)) return name;
  }
}

void Viewer::Steer(const WindowInput& input, double dt_s) {
  facts_.frame_ms = facts_.frame_ms == 0 ? frame_ms() : facts_.frame_ms + kSmoothing * (frame_ms() - facts_.frame_ms);
  TakePhotos();
  TakeProxy();
  TakeEstimates();
  ReadCorrected();
  steering_.moving = Move(input, dt_s);
  steering_.moving |= steering_.navigator.Tick(dt_s);
  steering_.moving |= Play(dt_s);
}

void Viewer::Paint() {
  AskForPhotos();
  KeepBudget();
  drawn_.changed = PaintPicture();
  StepJobs();
  StepRefinement(drawn_.changed, steering_.moving || steering_.navigator.flying() || window_.Dragging());
  StepHeatMap();
  StepColorLegend();
  FillHoles();
  KeepFacts();
}

void Viewer::KeepFacts() {
  facts_.nearest_photo = NearestView(scene_, steering_.navigator.state().cam_from_world);
  if (painter_.complete() && painter_.painted()) {
    facts_.plan_ms = gl_.statistics().plan_ms;
    // Smoothed over pictures of the same settings.
    const bool others = !(drawn_.cost_settings == drawn_.settings);
    drawn_.cost_settings = drawn_.settings;
    facts_.picture_ms = facts_.picture_ms == 0 || others
                            ? painter_.picture_ms()
                            : facts_.picture_ms + kSmoothing * (painter_.picture_ms() - facts_.picture_ms);
  }
  facts_.complete = painter_.complete();
  facts_.scale = painter_.empty() ? 1.0 : static_cast<double>(painter_.shown_size_px().x()) / size_px_.x();
}

void Viewer::DrawPanels() {
  if (!options_.show_ui) return;
  facts_.message = message();
  const RadianceSettings before = settings_.radiance;
  const PanelWishes wishes = DrawPanel(facts_, settings_);
  // Switched by the user, perhaps before the photos' estimates are known.
  for (const char* name : {"exposure", "white-balance", "vignetting"})
    if (IsOn(settings_.radiance, name) != IsOn(before, name)) decided_.Add(name);
  Grant(wishes);
  if (window_.Dragging() && steering_.drag_pivot)
    if (const auto x =
            Project(MakeWindowView(steering_.navigator.state(), size_px_.x(), size_px_.y()).P, *steering_.drag_pivot))
      DrawPivot(x->x(), x->y(), 1.0);
  DrawMarks();
}

double Viewer::Wait_s() const {
  const bool refining = !painter_.complete() && !Loading();
  if (steering_.moving || drawn_.changed || refining || Working() || steering_.navigator.flying() || window_.Dragging())
    return 0;
  if (rest_.refiner.busy()) return kRefiningWait_s;
  return !Settled() || RefinementOpen() || script_.given || jobs_.page_export || arriving_.proxy.valid()
             ? kLoadingWait_s
             : kIdleWait_s;
}

bool Viewer::AtRest() const {
  return Settled() && moving_.budget.ToProbe() == nullptr && painter_.complete() && drawn_.generation == generation_ &&
         !RefinementOpen() && !HeatOpen() && !ColorLegendOpen();
}

// Keeps a live recording up to the window's closing.
void Viewer::End() {
  if (!jobs_.live_recording) return;
  jobs_.live_recording->recorder->Finish();
  while (!jobs_.live_recording->recorder->Ended()) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  CloseRecording(*jobs_.live_recording->recorder);
}

void Viewer::Summarise(JsonKeys& j) {
  j("photos_loaded", facts_.photos_loaded, "photos_total", facts_.photos_total, "photos_failed", facts_.photos_failed);
  j("photo_mb", facts_.photo_mb, "on_demand", OnDemand(), "proxy", facts_.proxy, "device", facts_.device);
  j("settings", settings_.radiance, "refused", facts_.problem).Say("moving", moving_.budget.name());
  j.Say("refined", RefinementSummary()).Say("keys", path_.keys.size());
  j("metres_per_unit", facts_.metres_per_unit);
  j("legend", facts_.color_legend);
  j("effects", effects_.effects, "errors", facts_.errors, "videos", jobs_.videos);
}

}  // namespace lumi
