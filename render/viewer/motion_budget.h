// Settings that hold a frame time while the camera moves: steps along the scene's measured front (tradeoff/budget.h),
// or, if it has none for this machine, along settings that a probe measures in the window, one per frame. At rest the
// user's settings are drawn.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "render/tradeoff/budget.h"

namespace lumi {

class MotionBudget {
 public:
  // Fronts are looked for in the scene's folder.
  void Begin(double budget_ms, const std::filesystem::path& scene_folder, const FrontKey& key,
             const RadianceSettings& base);
  void End() { *this = MotionBudget(); }
  bool active() const { return budget_ms_ > 0; }
  double budget_ms() const { return budget_ms_; }

  // A setting whose time is wanted, or nullptr: nothing is to be probed (any more).
  const RadianceSettings* ToProbe() const { return next_ < probing_.size() ? &probing_[next_].settings : nullptr; }
  // The time of that setting at the window's size; nullopt: the backend does not support it.
  void Probed(std::optional<double> ms);

  // The settings to draw now in place of `base`; `base` itself at rest, while probing, and if the front's settings are
  // invalid with it.
  RadianceSettings Next(double now_s, bool camera_moved, const RadianceSettings& base);
  // The time that drawing took, at the window's size.
  void Measured(double ms) {
    if (controller_) controller_->Measured(ms);
  }
  const std::string& name() const { return name_; }  // of the settings used while moving, for people

 private:
  void Start(std::vector<FrontPoint> points);

  double budget_ms_ = 0;
  std::vector<FrontPoint> probing_, probed_;
  std::size_t next_ = 0;
  std::optional<BudgetController> controller_;
  std::string name_;
};

}  // namespace lumi
