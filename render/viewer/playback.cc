#include "render/viewer/playback.h"

#include <epoxy/gl.h>

#include <GLFW/glfw3.h>
#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <cmath>

#include "render/picture/border_fill.h"
#include "render/settings_json.h"
#include "render/show/proxy_picture.h"
#include "render/viewer/panel.h"
#include "render/viewer/setting_rules.h"
#include "scene/program/error.h"

namespace lumi {
namespace {

constexpr double kPlayerIdle_s = 0.1;
constexpr double kPlayed_ms = 60, kLeastScale = 0.25;  // a picture while the path plays: smaller where it takes longer
constexpr const char* kOffThePath = "this scene has no metric: it is seen along its path. Space plays, arrows step";

}  // namespace

Playback::Playback(const ViewerOptions& options, Window& window, const Opened& opened,
                   const std::vector<ScriptStep>& script)
    : ViewSession(window, script),
      opened_(opened),
      renderer_(opened.lumigraph.NewRenderer(MakeGlRendererHere)),
      settings_(opened.lumigraph.settings()),
      panel_(options.show_ui) {
  if (options.view.empty()) return;
  const std::string& name =
      opened_.lumigraph.scene().views[static_cast<std::size_t>(FindView(opened_.lumigraph.scene(), options.view))].name;
  for (std::size_t i = 0; i < opened_.matrices->keys.size(); ++i)
    if (opened_.matrices->keys[i].view == name) frame_ = static_cast<int>(i);
}

void Playback::Go(int frame) {
  playing_since_.reset();
  frame_ = std::clamp(frame, 0, last());
}

void Playback::GoToPhoto(const std::string& called) {
  const Scene& scene = opened_.lumigraph.scene();
  const std::string& name = scene.views[static_cast<std::size_t>(FindView(scene, called))].name;
  const auto& keys = opened_.matrices->keys;
  const auto found = std::find_if(keys.begin(), keys.end(), [&](const MatrixKey& k) { return k.view == name; });
  if (found == keys.end()) throw UsageError("no frame of the path is of the photo " + name);
  Go(static_cast<int>(found - keys.begin()));
}

void Playback::Play() {
  playing_from_ = frame_ < last() ? frame_ : 0;
  playing_since_ = Clock::now();
}

void Playback::Key(int key) {
  if (SeenKey(key, seen_) || PhotosKey(key, settings_)) return;
  switch (key) {
    case GLFW_KEY_ESCAPE: return window_.Close();
    case GLFW_KEY_SPACE: return playing_since_ ? playing_since_.reset() : Play();
    case GLFW_KEY_LEFT: return Go(frame_ - 1);
    case GLFW_KEY_RIGHT: return Go(frame_ + 1);
    case GLFW_KEY_HOME: return Go(0);
    case GLFW_KEY_END: return Go(last());
    case GLFW_KEY_B: fill_ = !fill_; return;
    case GLFW_KEY_TAB: panel_ = !panel_; return;
    default: return;
  }
}

void Playback::Steer(const WindowInput& input, double) {
  const bool off_the_path = !input.orbit_px.isZero() || !input.look_px.isZero() || !input.pan_px.isZero() ||
                            input.dolly_steps != 0 || input.zoom_steps != 0 || !input.fly.isZero();
  if (off_the_path) Say(kOffThePath);
  for (const int key : input.keys) Key(key);
  if (!playing_since_) return;
  const int due = playing_from_ + static_cast<int>(SecondsSince(*playing_since_) * opened_.matrices->fps);
  if (due != frame_) ++played_;
  frame_ = std::min(due, last());
  if (due >= last()) playing_since_.reset();
}

Eigen::Vector2i Playback::PictureSize() const {
  const Eigen::Vector2d window = size_px_.cast<double>(), path(opened_.matrices->width_px, opened_.matrices->height_px);
  return (path * window.cwiseQuotient(path).minCoeff()).array().round().max(1).cast<int>();
}

ImageF Playback::Picture(const RenderRequest& request) {
  if (const std::string problem = Validate(settings_); !problem.empty()) throw UsageError(problem);
  if (seen_.measure) return opened_.lumigraph.MapOf(request, *seen_.measure, -1).image;
  if (!seen_.flat) {
    ImageF picture = renderer_->Render(request);
    if (fill_ && seen_ == Seen{}) FillSmoothly(picture);
    return picture;
  }
  const PictureWorld world = opened_.lumigraph.For(request.view);
  return DrawProxy(world.sources, world.proxy, world.view);
}

// The picture in the middle of the window; what is around it is the backdrop.
void Playback::Paint() {
  const double scale = playing_since_ ? playing_scale_ : 1;
  Drawn wanted = Wanted();
  wanted.shown_px = (scale * size_px_.cast<double>()).array().round().max(1).cast<int>();
  if (drawn_ == wanted) return;
  const auto start = Clock::now();
  const Eigen::Vector2i size = (scale * PictureSize().cast<double>()).cast<int>().cwiseMax(1);
  RenderRequest request;
  request.view = opened_.frames[static_cast<std::size_t>(frame_)];
  request.view.P.row(0) *= static_cast<double>(size.x()) / opened_.matrices->width_px;
  request.view.P.row(1) *= static_cast<double>(size.y()) / opened_.matrices->height_px;
  request.view.size_px = size;
  request.settings = opened_.lumigraph.At(request.view, settings_);
  request.show = seen_.show == Show::kTessellation && !settings_.Sparse() ? Show::kColor : seen_.show;
  ImageF image;
  try {
    image = Picture(request);
    problem_.clear();
  } catch (const Error& e) {
    if (script_.given) throw;
    problem_ = e.what();
    drawn_ = wanted;
    return;
  }
  ImageF whole(wanted.shown_px.x(), wanted.shown_px.y(), 4);
  const Eigen::Vector2i at = ((wanted.shown_px - size) / 2).cwiseMax(0);
  for (int y = 0; y < size.y(); ++y)
    std::copy_n(image.Row(y), 4 * static_cast<std::size_t>(size.x()), whole.Row(at.y() + y) + 4 * at.x());
  picture_.Set(whole);
  drawn_ = wanted;
  picture_ms_ = 1000 * SecondsSince(start);
  if (playing_since_)
    playing_scale_ = std::clamp(scale * std::sqrt(kPlayed_ms / std::max(picture_ms_, 1.0)), kLeastScale, 1.0);
}

void Playback::Compose() {
  if (picture_.empty())
    overlay_.PresentNothing(size_px_);
  else
    overlay_.Present(picture_, size_px_);
}

void Playback::DrawPanels() {
  if (panel_) DrawPanel();
  DrawMessage(message());
}

void Playback::DrawPanel() {
  const float unit = ImGui::GetFontSize();
  const ImVec2 size = ImGui::GetIO().DisplaySize;
  ImGui::SetNextWindowPos({unit, unit}, ImGuiCond_FirstUseEver);
  ImGui::SetNextWindowSize({std::min(25 * unit, size.x), 0}, ImGuiCond_Always);
  ImGui::Begin("path of matrices", nullptr, ImGuiWindowFlags_NoFocusOnAppearing | ImGuiWindowFlags_NoNav);
  ImGui::PushItemWidth(-8.5F * unit);
  ImGui::TextUnformatted(fmt::format("{} scene, {} photos, {:.0f} ms a picture", Name(opened_.lumigraph.scene().frame),
                                     opened_.lumigraph.scene().views.size(), picture_ms_)
                             .c_str());
  if (ImGui::Button(playing_since_ ? "stop" : "play", {5 * unit, 0})) {
    if (playing_since_)
      playing_since_.reset();
    else
      Play();
  }
  ImGui::SameLine();
  int frame = frame_;
  if (ImGui::SliderInt("frame", &frame, 0, last())) Go(frame);
  if (const std::string& view = opened_.matrices->keys[static_cast<std::size_t>(frame_)].view; !view.empty())
    ImGui::TextUnformatted(view.c_str());
  if (ImGui::BeginCombo("shown", std::string(NameOf(seen_)).c_str())) {
    for (const SeenName& s : SeenNames())
      if (ImGui::Selectable(std::string(s.name).c_str(), s.seen == seen_)) seen_ = s.seen;
    ImGui::EndCombo();
  }
  ImGui::SliderInt("photos a pixel", &settings_.k, 1, kMaxBlend);
  ImGui::Checkbox("time", &settings_.time);
  ImGui::SameLine();
  ImGui::Checkbox("exposure", &settings_.exposure);
  ImGui::SameLine();
  ImGui::Checkbox("fill", &fill_);
  ImGui::PopItemWidth();
  if (!problem_.empty()) ImGui::TextWrapped("%s", problem_.c_str());
  ImGui::End();
}

bool Playback::RunStatement(const ScriptStep& s) {
  switch (s.verb) {
    case ScriptVerb::kPlay:
      if (!script_.waiting) Play();
      script_.waiting = true;
      return !playing_since_;
    case ScriptVerb::kKeyJump: Go(static_cast<int>(s.numbers[0])); return true;
    case ScriptVerb::kJump: GoToPhoto(s.word); return true;
    case ScriptVerb::kShow: seen_ = *SeenFromName(s.word); return true;
    case ScriptVerb::kK: settings_.k = s.word == "all" ? 0 : std::stoi(s.word); return true;
    case ScriptVerb::kSet:
      SetOption(settings_, s.word, s.value);
      Reconcile(settings_, s.word);
      return true;
    case ScriptVerb::kFill: fill_ = s.word == "on"; return true;
    case ScriptVerb::kPanel: panel_ = s.word == "on"; return true;
    default:
      throw UsageError(fmt::format("'{}': a path of matrices is played, stepped through (key-jump, jump) and shown in "
                                   "other ways (show, k, set), not left",
                                   s.text),
                       kOffThePath);
  }
}

double Playback::Wait_s() const { return playing_since_ || script_.given || !(drawn_ == Wanted()) ? 0 : kPlayerIdle_s; }

void Playback::Summarise(JsonKeys& j) {
  const Lumigraph& lumigraph = opened_.lumigraph;
  j.Say("frame", Name(lumigraph.scene().frame)).Say("keys", opened_.matrices->keys.size())("played", played_);
  j.Say("proxy", lumigraph.proxy_name()).Say("device", renderer_->Device())("settings", settings_);
  j.Say("effects", lumigraph.effects());
}

}  // namespace lumi
