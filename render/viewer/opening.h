// Opening a scene for the viewer, on a thread of its own while the window shows how far it is.
#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "render/lumigraph/lumigraph.h"
#include "render/path/camera_path.h"
#include "render/viewer/viewer.h"
#include "scene/files/matrix_path.h"
#include "scene/program/interrupt.h"

namespace lumi {

// The opening thread's progress, for the window; also passed on to the terminal.
class OpeningProgress final : public ProgressSink {
 public:
  explicit OpeningProgress(ProgressSink& terminal) : terminal_(terminal) {}
  void Report(const std::string& task, long done, long total, double seconds, double left) override {
    {
      const std::lock_guard lock(mutex_);
      if (cancelled_) throw Interrupted();
      task_ = task;
      fraction_ = total > 0 ? static_cast<double>(done) / static_cast<double>(total) : -1;
    }
    terminal_.Report(task, done, total, seconds, left);
  }
  void Finish(const std::string& task, long done, double seconds) override { terminal_.Finish(task, done, seconds); }
  void Message(const std::string& line) override { terminal_.Message(line); }
  void Cancel() {
    const std::lock_guard lock(mutex_);
    cancelled_ = true;
  }
  std::pair<std::string, double> Now() {
    const std::lock_guard lock(mutex_);
    return {task_, fraction_};
  }

 private:
  ProgressSink& terminal_;
  std::mutex mutex_;
  std::string task_;
  double fraction_ = -1;
  bool cancelled_ = false;
};

// A proxy with its visibility maps, which are slow to make and need no window. Never changed afterwards.
struct PreparedProxy {
  std::string name;
  Mesh mesh;
  std::shared_ptr<const VisibilityMaps> visibility;
  std::shared_ptr<const ProxyTracer> tracer;
};
PreparedProxy PrepareProxy(const std::string& name, Mesh mesh, const Sources& sources);

struct Opened {
  Lumigraph lumigraph;
  std::optional<MatrixPath>
      matrices;  // set if the lumigraph is played along matrices: a scene without a metric, or the user's path
  std::vector<RenderView> frames;  // of that path, at its size
  // Only without `matrices`, where the camera moves freely:
  PreparedProxy proxy;
  EffectChoice effects;  // called for by the data, except those that need the photos, which are not read yet
  CameraPath path;
};

// Sets the effects of `choice` in `settings`, except those in `decided`; other settings stay.
void ApplyEffects(const EffectChoice& choice, const Decided& decided, RadianceSettings& settings);
// Sets effects from a script's list, none or auto; effects not in the list are switched off. Throws UsageError.
void SetEffects(const std::string& list, const EffectChoice& choice, RadianceSettings& settings);

// By name, or by position. Throws UsageError.
int FindView(const Scene& scene, const std::string& name);

// Throws what OpenScene and LoadProxy throw; DataError for a scene that cannot be shown.
std::unique_ptr<Opened> OpenForViewing(const ViewerOptions& options, ProgressSink& progress);

}  // namespace lumi
