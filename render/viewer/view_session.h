// The common part of viewing a lumigraph: a window, frames until it is closed, a script, messages, screenshots, a
// summary. Viewer lets the camera go anywhere, Playback along a path of matrices.
#pragma once

#include <chrono>
#include <deque>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "render/viewer/overlay.h"
#include "render/viewer/script.h"
#include "render/viewer/seen.h"
#include "render/viewer/window.h"
#include "scene/files/json_keys.h"
#include "scene/program/stopwatch.h"

namespace lumi {

using Clock = std::chrono::steady_clock;

class ViewSession {
 public:
  ViewSession(Window& window, const std::vector<ScriptStep>& script)
      : window_(window), script_{{script.begin(), script.end()}, !script.empty()} {}
  virtual ~ViewSession() = default;

  // Until the window is closed, or the script ends.
  JsonKeys Run();
  bool panel_shown() const { return panel(); }
  // A message that stands at the start.
  void Greet(const std::string& text) { Say(text, 20); }
  // When the first picture of photos had been shown. Frames are timed from then on: before, shaders are compiled.
  std::optional<Clock::time_point> first_picture() const { return first_picture_; }
  // A scene that was dropped on the window, which ended Run; empty: none. What is left of the script is for it.
  const std::filesystem::path& dropped() const { return dropped_; }
  std::vector<ScriptStep> script_left() const { return {script_.steps.begin(), script_.steps.end()}; }

 protected:
  // The parts of a frame, in this order.
  virtual void Steer(const WindowInput& input, double dt_s) = 0;
  virtual bool RunStatement(const ScriptStep& s) = 0;  // false: it has to wait; not for 'wait' and 'screenshot'
  virtual void Paint() = 0;
  virtual void DrawPanels() = 0;  // between Window::BeginUi and EndUi
  virtual void Compose() = 0;     // draws the picture, without the panels, into the bound framebuffer
  virtual void AfterComposing() {}
  virtual double Wait_s() const = 0;  // before the next

  virtual bool painted() const { return true; }      // the last Paint drew something
  virtual bool with_photos() const { return true; }  // ... of photos that are there
  virtual bool AtRest() const = 0;                   // nothing changes by itself any more; ends a script's 'wait'
  virtual bool ReadyForScreenshot() const = 0;
  virtual bool panel() const = 0;           // is shown
  virtual void Summarise(JsonKeys& j) = 0;  // adds to it
  virtual void End() {}                     // the window was closed

  void Say(const std::string& message, double seconds = 4.0);
  const std::string& message() const { return message_; }
  double frame_ms() const { return last_ms_; }  // that the last frame took
  void Screenshot(const std::filesystem::path& file, bool with_ui);

  struct Script {
    std::deque<ScriptStep> steps;
    bool given = false;  // the viewer ends after the last
    bool waiting = false;
    Clock::time_point since = Clock::now();  // when the current statement began to wait
  };

  Window& window_;
  Overlay overlay_;
  Script script_;
  Eigen::Vector2i size_px_ = {1, 1};  // of the window

 private:
  void RunScript();
  void Take(const std::filesystem::path& dropped);
  void AfterPainting();

  std::filesystem::path dropped_;
  std::string message_;
  Clock::time_point message_until_ = Clock::now();
  std::vector<std::string> screenshots_;
  double last_ms_ = 0;
  std::vector<double> frame_ms_;
  std::optional<Clock::time_point> first_picture_;
};

// F, G, [ and ]: what is seen, and photos a pixel. Returns whether it was one of them.
bool SeenKey(int key, Seen& seen);
bool PhotosKey(int key, RadianceSettings& settings);

}  // namespace lumi
