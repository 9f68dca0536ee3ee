#include "render/viewer/matrix_player.h"

#include <epoxy/gl.h>

#include <GLFW/glfw3.h>
#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>

#include "render/picture/output_name.h"
#include "render/settings_json.h"
#include "render/show/proxy_picture.h"
#include "render/viewer/canvas.h"
#include "render/viewer/opening.h"
#include "render/viewer/setting_rules.h"
#include "scene/files/image_io.h"
#include "scene/program/error.h"
#include "scene/program/interrupt.h"
#include "scene/program/stopwatch.h"

namespace lumi {
namespace {

constexpr double kPlayerIdle_s = 0.1;
constexpr double kPlayerMessage_s = 4.0;
constexpr double kPlayed_ms = 60, kLeastScale = 0.25;  // a picture while the path plays: smaller where it takes longer
constexpr const char* kOffThePath = "this scene has no metric: it is seen along its path. Space plays, arrows step";

}  // namespace

MatrixPlayer::MatrixPlayer(const ViewerOptions& options, Window& window, const Opened& opened, std::vector<ScriptStep> script)
    : window_(window),
      opened_(opened),
      renderer_(opened.lumigraph.NewRenderer(MakeGlRendererHere)),
      settings_(opened.lumigraph.settings()),
      panel_(options.show_ui),
      script_(script.begin(), script.end()),
      scripted_(!script.empty()) {
  if (options.view.empty()) return;
  const std::string& name = opened_.lumigraph.scene().views[static_cast<std::size_t>(FindView(opened_.lumigraph.scene(), options.view))].name;
  for (std::size_t i = 0; i < opened_.matrices->keys.size(); ++i)
    if (opened_.matrices->keys[i].view == name) frame_ = static_cast<int>(i);
}

void MatrixPlayer::Say(const std::string& message) {
  message_ = message;
  message_until_ = Clock::now() + std::chrono::milliseconds(static_cast<int>(1000 * kPlayerMessage_s));
}

void MatrixPlayer::Go(int frame) {
  playing_since_.reset();
  frame_ = std::clamp(frame, 0, static_cast<int>(opened_.frames.size()) - 1);
}

void MatrixPlayer::Steer(const WindowInput& input) {
  const bool off_the_path = !input.orbit_px.isZero() || !input.look_px.isZero() || !input.pan_px.isZero() || input.dolly_steps != 0 || input.zoom_steps != 0 || !input.fly.isZero();
  if (off_the_path) Say(kOffThePath);
  for (const int key : input.keys) switch (key) {
      case GLFW_KEY_ESCAPE: window_.Close(); break;
      case GLFW_KEY_SPACE:
        if (playing_since_)
          playing_since_.reset();
        else
          Play();
        break;
      case GLFW_KEY_LEFT: Go(frame_ - 1); break;
      case GLFW_KEY_RIGHT: Go(frame_ + 1); break;
      case GLFW_KEY_HOME: Go(0); break;
      case GLFW_KEY_END: Go(static_cast<int>(opened_.frames.size()) - 1); break;
      case GLFW_KEY_F: seen_ = seen_ == Seen{} ? Seen{.show = Show::kFalseColor} : Seen{}; break;
      case GLFW_KEY_G: seen_ = seen_.flat ? Seen{} : Seen{.flat = true}; break;
      case GLFW_KEY_TAB: panel_ = !panel_; break;
      case GLFW_KEY_LEFT_BRACKET: settings_.k = settings_.k == 0 ? kMaxBlend : std::max(1, settings_.k - 1); break;
      case GLFW_KEY_RIGHT_BRACKET: settings_.k = settings_.k == 0 || settings_.k == kMaxBlend ? 0 : settings_.k + 1; break;
      default: break;
    }
}

void MatrixPlayer::Play() {
  playing_from_ = frame_ + 1 < static_cast<int>(opened_.frames.size()) ? frame_ : 0;
  playing_since_ = Clock::now();
}

Eigen::Vector2i MatrixPlayer::PictureSize() const {
  const Eigen::Vector2d window = window_.FramebufferSize().cwiseMax(1).cast<double>(), path(opened_.matrices->width_px, opened_.matrices->height_px);
  return (path * window.cwiseQuotient(path).minCoeff()).array().round().max(1).cast<int>();
}

// The picture in the middle of the window; what is around it is the backdrop.
void MatrixPlayer::Paint() {
  const Eigen::Vector2i window_px = window_.FramebufferSize().cwiseMax(1);
  const double scale = playing_since_ ? playing_scale_ : 1;
  const Drawn wanted{frame_, (scale * window_px.cast<double>()).array().round().max(1).cast<int>(), seen_, settings_};
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
    if (const std::string problem = Validate(settings_); !problem.empty()) throw UsageError(problem);
    if (seen_.flat) {
      const PictureWorld world = opened_.lumigraph.For(request.view);
      image = DrawProxy(world.sources, world.proxy, world.view);
    } else if (seen_.measure) {
      image = opened_.lumigraph.MapOf(request, *seen_.measure, -1).image;
    } else {
      image = renderer_->Render(request);
    }
    problem_.clear();
  } catch (const Error& e) {
    if (scripted_) throw;
    problem_ = e.what();
    drawn_ = wanted;
    return;
  }
  ImageF whole(wanted.shown_px.x(), wanted.shown_px.y(), 4);
  const Eigen::Vector2i at = ((wanted.shown_px - size) / 2).cwiseMax(0);
  for (int y = 0; y < size.y(); ++y) std::copy_n(image.Row(y), 4 * static_cast<std::size_t>(size.x()), whole.Row(at.y() + y) + 4 * at.x());
  picture_.Set(whole);
  drawn_ = wanted;
  picture_ms_ = 1000 * SecondsSince(start);
  if (playing_since_) playing_scale_ = std::clamp(scale * std::sqrt(kPlayed_ms / std::max(picture_ms_, 1.0)), kLeastScale, 1.0);
}

void MatrixPlayer::DrawUi() {
  window_.BeginUi();
  const float unit = ImGui::GetFontSize();
  const ImVec2 size = ImGui::GetIO().DisplaySize;
  if (panel_) {
    ImGui::SetNextWindowPos({unit, unit}, ImGuiCond_FirstUseEver);
    ImGui::SetNextWindowSize({std::min(25 * unit, size.x), 0}, ImGuiCond_Always);
    ImGui::Begin("path of matrices", nullptr, ImGuiWindowFlags_NoFocusOnAppearing | ImGuiWindowFlags_NoNav);
    ImGui::PushItemWidth(-8.5F * unit);
    ImGui::TextUnformatted(fmt::format("{} scene, {} photos, {:.0f} ms a picture", Name(opened_.lumigraph.scene().frame), opened_.lumigraph.scene().views.size(), picture_ms_).c_str());
    if (ImGui::Button(playing_since_ ? "stop" : "play", {5 * unit, 0})) {
      if (playing_since_)
        playing_since_.reset();
      else
        Play();
    }
    ImGui::SameLine();
    int frame = frame_;
    if (ImGui::SliderInt("frame", &frame, 0, static_cast<int>(opened_.frames.size()) - 1)) Go(frame);
    if (const std::string& view = opened_.matrices->keys[static_cast<std::size_t>(frame_)].view; !view.empty()) ImGui::TextUnformatted(view.c_str());
    if (ImGui::BeginCombo("shown", std::string(NameOf(seen_)).c_str())) {
      for (const SeenName& s : SeenNames())
        if (ImGui::Selectable(std::string(s.name).c_str(), s.seen == seen_)) seen_ = s.seen;
      ImGui::EndCombo();
    }
    ImGui::SliderInt("photos a pixel", &settings_.k, 1, kMaxBlend);
    ImGui::Checkbox("time", &settings_.time);
    ImGui::SameLine();
    ImGui::Checkbox("exposure", &settings_.exposure);
    ImGui::PopItemWidth();
    if (!problem_.empty()) ImGui::TextWrapped("%s", problem_.c_str());
    ImGui::End();
  }
  if (!message_.empty() && Clock::now() < message_until_) {
    ImGui::SetNextWindowPos({0.5F * size.x, size.y - unit}, ImGuiCond_Always, {0.5F, 1});
    ImGui::Begin("message", nullptr, ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoInputs | ImGuiWindowFlags_NoNav);
    ImGui::TextUnformatted(message_.c_str());
    ImGui::End();
  }
  window_.EndUi();
}

void MatrixPlayer::Screenshot(const std::string& file) {
  const Eigen::Vector2i size = window_.FramebufferSize().cwiseMax(1);
  const Canvas canvas(size);
  overlay_.Present(picture_, size);
  if (panel_) window_.DrawUi();
  WriteImage(file, canvas.Read());
  glBindFramebuffer(GL_FRAMEBUFFER, 0);
  screenshots_.push_back(file);
}

// After the picture was drawn: statements up to one that has to wait.
void MatrixPlayer::RunScript() {
  while (!script_.empty()) {
    const ScriptStep& s = script_.front();
    const Drawn now = AtRest();
    switch (s.verb) {
      case ScriptVerb::kWait:
        if (!waiting_) waiting_since_ = Clock::now();
        waiting_ = true;
        if (playing_since_ || !(drawn_ == now) || (!s.numbers.empty() && SecondsSince(waiting_since_) < s.numbers[0])) return;
        break;
      case ScriptVerb::kScreenshot:
        if (!(drawn_ == now)) return;
        Screenshot(s.word);
        break;
      case ScriptVerb::kPlay:
        if (!waiting_) Play();
        waiting_ = true;
        if (playing_since_) return;
        break;
      case ScriptVerb::kKeyJump: Go(static_cast<int>(s.numbers[0])); break;
      case ScriptVerb::kJump: {
        const std::string& name = opened_.lumigraph.scene().views[static_cast<std::size_t>(FindView(opened_.lumigraph.scene(), s.word))].name;
        const auto& keys = opened_.matrices->keys;
        const auto found = std::find_if(keys.begin(), keys.end(), [&](const MatrixKey& k) { return k.view == name; });
        if (found == keys.end()) throw UsageError("no frame of the path is of the photo " + name);
        Go(static_cast<int>(found - keys.begin()));
        break;
      }
      case ScriptVerb::kShow: seen_ = *SeenFromName(s.word); break;
      case ScriptVerb::kK: settings_.k = s.word == "all" ? 0 : std::stoi(s.word); break;
      case ScriptVerb::kSet:
        SetOption(settings_, s.word, s.value);
        Reconcile(settings_, s.word);
        break;
      case ScriptVerb::kPanel: panel_ = s.word == "on"; break;
      default:
        throw UsageError(fmt::format("'{}': a path of matrices is played, stepped through (key-jump, jump) and shown in other ways (show, k, set), not left", s.text), kOffThePath);
    }
    waiting_ = false;
    script_.pop_front();
  }
}

nlohmann::json MatrixPlayer::Run() {
  long frames = 0;
  auto last = Clock::now();
  while (!window_.ShouldClose()) {
    CheckInterrupted();
    window_.Poll(playing_since_ || scripted_ || !(drawn_ == AtRest()) ? 0 : kPlayerIdle_s);
    Steer(window_.Take());
    if (playing_since_) {
      const int end = static_cast<int>(opened_.frames.size()) - 1;
      const int due = playing_from_ + static_cast<int>(SecondsSince(*playing_since_) * opened_.matrices->fps);
      if (due != frame_) ++played_;
      frame_ = std::min(due, end);
      if (due >= end) playing_since_.reset();
    }
    Paint();
    DrawUi();
    if (scripted_) RunScript();
    const Eigen::Vector2i size = window_.FramebufferSize().cwiseMax(1);
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    if (picture_.empty())
      overlay_.PresentNothing(size);
    else
      overlay_.Present(picture_, size);
    window_.DrawUi();
    window_.Swap();
    ++frames;
    frame_ms_.push_back(1000 * SecondsSince(last));
    last = Clock::now();
    if (scripted_ && script_.empty()) break;
  }
  nlohmann::json j;
  std::sort(frame_ms_.begin(), frame_ms_.end());
  j["frames"] = frames;
  j["median_frame_ms"] = frame_ms_.empty() ? 0.0 : frame_ms_[frame_ms_.size() / 2];
  j["frame"] = Name(opened_.lumigraph.scene().frame);
  j["keys"] = opened_.matrices->keys.size();
  j["played"] = played_;
  j["proxy"] = kPerViewProxy;
  j["device"] = renderer_->Device();
  j["screenshots"] = screenshots_;
  j["settings"] = ToJson(settings_);
  j["effects"] = nlohmann::json::array();
  for (const Effect& e : opened_.lumigraph.effects()) j["effects"].push_back({{"name", e.name}, {"on", e.on}, {"evidence", Reason(e)}});
  return j;
}

}  // namespace lumi
