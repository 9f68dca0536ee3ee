#include "render/viewer/viewer.h"
#include "render/comparators/comparators.h"

#include <epoxy/gl.h>

#include <chrono>
#include <future>

#include "render/viewer/playback.h"
#include "render/viewer/remembered.h"
#include "render/viewer/viewer_app.h"
#include "scene/files/image_io.h"
#include "scene/files/scene_folder.h"
#include "scene/program/error.h"
#include "scene/program/interrupt.h"

namespace lumi {
namespace {

struct Viewed {
  JsonKeys summary;
  std::filesystem::path next = {};      // a scene that is to be opened in place of this one; empty: none
  std::vector<ScriptStep> script = {};  // what is left of it
};

// One scene, in a window of its own, until that is closed.
Viewed ViewScene(const ViewerOptions& options, const std::vector<ScriptStep>& script, ProgressSink& progress,
                 const std::string& message = {}) {
  const auto start = Clock::now();
  Window window("lumi-view: " + NameOfFolder(options.scene), options.width_px, options.height_px);
  OpeningProgress opening(progress);
  auto future = std::async(std::launch::async, [&] { return OpenForViewing(options, opening); });
  while (future.wait_for(std::chrono::milliseconds(30)) != std::future_status::ready) {
    window.Poll(0);
    if (window.ShouldClose() || InterruptRequested()) opening.Cancel();
    const auto [task, fraction] = opening.Now();
    window.BeginUi();
    DrawOpening(options.scene.string(), task, fraction);
    window.EndUi();
    const Eigen::Vector2i size = window.FramebufferSize();
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    glViewport(0, 0, size.x(), size.y());
    glClearColor(0.115F, 0.12F, 0.13F, 1);
    glClear(GL_COLOR_BUFFER_BIT);
    window.DrawUi();
    window.Swap();
  }
  try {
    const std::unique_ptr<Opened> opened = future.get();
    std::unique_ptr<ViewSession> session;
    if (opened->matrices)
      session = std::make_unique<Playback>(options, window, *opened, script);
    else
      session = std::make_unique<Viewer>(options, window, *opened, progress, script);
    if (!message.empty()) session->Greet(message);
    JsonKeys summary = session->Run();
    if (const auto seen = session->first_picture())
      summary.Say("seconds_to_open", std::chrono::duration<double>(*seen - start).count());
    if (script.empty())
      Keep({window.Size().x(), window.Size().y(), options.show_ui ? session->panel_shown() : options.panel},
           RememberedFile());
    return {std::move(summary), session->dropped(), session->script_left()};
  } catch (const Interrupted&) {
    if (InterruptRequested()) throw;
    return {JsonKeys().Say("frames", 0)};  // the window was closed while the scene was opened
  }
}

}  // namespace

JsonKeys RunViewer(const ViewerOptions& options, ProgressSink& progress) {
  if (const std::string problem = Validate(options.settings); !problem.empty()) throw UsageError(problem);
  if (const std::string problem = ProblemOf(options.settings); !problem.empty()) throw UsageError(problem);
  if (options.settings.correlation == Correlation::kMeasured)
    throw UsageError(
        "--correlation measured reads all photos before the first picture",
        "lumi-render SCENE --correlation measured --json prints r-min-deg, r-max-deg and noise, which go with "
        "--correlation falling-leaves");
  if (options.phase && options.decided.Has("time-s")) throw UsageError("--phase and --time-s do not go together");
  std::vector<ScriptStep> script = ParseScript(options.script);
  if (!options.screenshot.empty()) {
    if (!HasImageExtension(options.screenshot))
      throw UsageError("--screenshot writes a picture: " + options.screenshot.string(), "name it FILE.png");
    ScriptStep wait, shot;
    wait.text = "wait";
    shot.verb = ScriptVerb::kScreenshot;
    shot.word = options.screenshot.string();
    script.push_back(wait);
    script.push_back(shot);
  }
  if (!std::filesystem::exists(options.scene)) throw UsageError("there is no scene at " + options.scene.string());
  ViewerOptions seen = options;
  // A script sees the same wherever it runs.
  if (script.empty()) {
    const Remembered last = Remember(RememberedFile());
    if (!seen.decided.Has("width") && !seen.decided.Has("height")) {
      seen.width_px = last.width_px;
      seen.height_px = last.height_px;
    }
    seen.panel = last.panel;
  }
  Viewed viewed = ViewScene(seen, script, progress);
  // A script that ends with a drop has nothing to see in the scene that it dropped.
  while (!viewed.next.empty() && (script.empty() || !viewed.script.empty())) {
    ViewerOptions other = seen;
    other.scene = viewed.next;
    // These name something in the first scene.
    other.proxy.clear();
    other.view.clear();
    other.path.clear();
    other.phase.reset();
    try {
      viewed = ViewScene(other, viewed.script, progress);
      seen = other;
    } catch (const Interrupted&) {
      throw;
    } catch (const Error& e) {
      if (!script.empty()) throw;
      viewed = ViewScene(seen, {}, progress, e.what());
    }
  }
  return viewed.summary;
}

}  // namespace lumi
