#include "render/viewer/viewer.h"
#include "render/comparators/comparators.h"

#include <epoxy/gl.h>

#include <chrono>
#include <future>

#include "render/viewer/playback.h"
#include "render/viewer/viewer_app.h"
#include "scene/files/image_io.h"
#include "scene/program/error.h"
#include "scene/program/interrupt.h"

namespace lumi {

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

  const auto start = Clock::now();
  Window window("lumi-view: " + options.scene.filename().string(), options.width_px, options.height_px);
  OpeningProgress opening(progress);
  auto future = std::async(std::launch::async, [&] { return OpenForViewing(options, opening); });
  JsonKeys j;
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
    const double opened_s = SecondsSince(start);
    std::unique_ptr<ViewSession> session;
    if (opened->matrices)
      session = std::make_unique<Playback>(options, window, *opened, script);
    else
      session = std::make_unique<Viewer>(options, window, *opened, progress, script);
    j = session->Run().Say("seconds_to_open", opened_s);
  } catch (const Interrupted&) {
    if (InterruptRequested()) throw;
    j.Say("frames", 0);  // the window was closed while the scene was opened
  }
  return j;
}

}  // namespace lumi
