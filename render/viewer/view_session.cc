#include "render/viewer/view_session.h"

#include <epoxy/gl.h>

#include <GLFW/glfw3.h>

#include <algorithm>

#include "render/viewer/canvas.h"
#include "scene/files/image_io.h"
#include "scene/files/scene_folder.h"
#include "scene/geometry/median.h"
#include "scene/program/error.h"
#include "scene/program/interrupt.h"

namespace lumi {
namespace {

constexpr double kScriptPatience_s = 900;  // for a 'wait'
constexpr double kLongestStep_s = 0.25;

}  // namespace

void ViewSession::Say(const std::string& message, double seconds) {
  message_ = message;
  message_until_ = Clock::now() + std::chrono::milliseconds(static_cast<int>(1000 * seconds));
}

void ViewSession::Screenshot(const std::filesystem::path& file, bool with_ui) {
  const Canvas canvas(size_px_);
  Compose();
  if (with_ui) window_.DrawUi();
  WriteImage(file, canvas.Read());
  glBindFramebuffer(GL_FRAMEBUFFER, 0);
  screenshots_.push_back(file.string());
  if (!script_.given) Say("wrote " + file.string());  // the message must not show in the next screenshot
}

// Runs statements up to one that has to wait; those that wait for a picture go on in AfterPainting.
void ViewSession::RunScript() {
  while (!script_.steps.empty()) {
    const ScriptStep& s = script_.steps.front();
    if (s.verb == ScriptVerb::kDrop) {
      const std::filesystem::path scene = s.word;
      script_.steps.pop_front();
      Take(scene);
      return;
    }
    if (s.verb == ScriptVerb::kWait || s.verb == ScriptVerb::kScreenshot || !RunStatement(s)) return;
    script_.waiting = false;
    script_.steps.pop_front();
  }
}

// Only a scene ends this one.
void ViewSession::Take(const std::filesystem::path& dropped) {
  OpenOptions quickly;
  quickly.check_photos = quickly.undistort = false;
  try {
    OpenScene(dropped, quickly, SilentProgress());
  } catch (const std::exception& e) {
    if (script_.given) throw;
    Say(e.what());
    return;
  }
  dropped_ = dropped;
  window_.Close();
}

void ViewSession::AfterPainting() {
  if (script_.steps.empty()) return;
  const ScriptStep& s = script_.steps.front();
  if (s.verb == ScriptVerb::kWait) {
    if (!script_.waiting) script_.since = Clock::now();
    script_.waiting = true;
    const double waited = SecondsSince(script_.since);
    const bool done = s.numbers.empty() ? AtRest() : waited >= s.numbers[0];
    if (!done && waited < std::max(kScriptPatience_s, s.numbers.empty() ? 0.0 : s.numbers[0])) return;
    if (!done)
      throw MachineError("the script's 'wait' took longer than " + std::to_string(static_cast<int>(kScriptPatience_s)) +
                         " seconds");
  } else if (s.verb == ScriptVerb::kScreenshot) {
    if (!ReadyForScreenshot()) return;
    Screenshot(s.word, panel());
  } else {
    return;
  }
  script_.waiting = false;
  script_.steps.pop_front();
}

JsonKeys ViewSession::Run() {
  auto last = Clock::now();
  long frames = 0;
  double wait_s = 0;
  while (!window_.ShouldClose()) {
    CheckInterrupted();
    window_.Poll(wait_s);
    size_px_ = window_.FramebufferSize().cwiseMax(1);
    const double dt = std::min(SecondsSince(last), kLongestStep_s);
    last = Clock::now();
    const WindowInput input = window_.Take();
    Steer(input, dt);
    if (!input.dropped.empty()) Take(input.dropped);
    if (script_.given) RunScript();
    Paint();
    if (Clock::now() > message_until_) message_.clear();
    window_.BeginUi();
    DrawPanels();
    window_.EndUi();
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    Compose();
    AfterComposing();
    window_.DrawUi();
    window_.Swap();
    ++frames;
    last_ms_ = 1000 * SecondsSince(last);
    if (painted() && first_picture_)
      frame_ms_.push_back(last_ms_);
    else if (painted() && with_photos())
      first_picture_ = Clock::now();
    if (script_.given) {
      AfterPainting();
      if (script_.steps.empty() || !dropped_.empty()) break;
    }
    wait_s = Wait_s();
  }
  End();
  JsonKeys j;
  j.Say("frames", frames).Say("median_frame_ms", Median(frame_ms_)).Say("screenshots", screenshots_);
  if (!frame_ms_.empty()) {
    std::ranges::sort(frame_ms_);
    j.Say("frame_ms_99", frame_ms_[(frame_ms_.size() - 1) * 99 / 100]).Say("slowest_frame_ms", frame_ms_.back());
  }
  Summarise(j);
  return j;
}

bool SeenKey(int key, Seen& seen) {
  if (key == GLFW_KEY_F)
    seen = seen == Seen{} ? Seen{.show = Show::kFalseColor} : Seen{};
  else if (key == GLFW_KEY_G)
    seen = seen.flat ? Seen{} : Seen{.flat = true};
  else
    return false;
  return true;
}

bool PhotosKey(int key, RadianceSettings& settings) {
  int& k = settings.k;
  if (key == GLFW_KEY_LEFT_BRACKET)
    k = k == 0 ? kMaxBlend : std::max(1, k - 1);
  else if (key == GLFW_KEY_RIGHT_BRACKET)
    k = k == 0 || k == kMaxBlend ? 0 : k + 1;
  else
    return false;
  return true;
}

}  // namespace lumi
