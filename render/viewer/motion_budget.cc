#include "render/viewer/motion_budget.h"

#include <utility>

namespace lumi {
namespace {

constexpr double kHopeless = 4;  // times the budget: what costs more is not probed

}  // namespace

void MotionBudget::Begin(double budget_ms, const std::filesystem::path& scene_folder, const FrontKey& key,
                         const RadianceSettings& base) {
  if (active() && (controller_ || ToProbe() != nullptr)) {
    budget_ms_ = budget_ms;
    if (controller_) controller_->SetBudget(budget_ms);
    return;
  }
  End();
  budget_ms_ = budget_ms;
  if (const auto stored = FindFront(scene_folder, key); stored && !stored->points.empty()) return Start(stored->points);
  // Only real-time weights are probed: the optimum is for a resting camera.
  for (FrontPoint& p : ProbeTable(base, {}))
    if (p.settings.similarity == Similarity::kIdentity) probing_.push_back(std::move(p));
}

void MotionBudget::Probed(std::optional<double> ms) {
  if (ToProbe() == nullptr) return;
  FrontPoint p = probing_[next_++];
  if (ms) {
    p.ms = *ms;
    // The table ascends in accuracy, so its order stands for the quality, which is not measured.
    p.psnr_optimum_db = static_cast<double>(next_);
    probed_.push_back(p);
  }
  if (ms && *ms > kHopeless * budget_ms_) next_ = probing_.size();
  if (next_ == probing_.size()) Start(ParetoFront(std::move(probed_)));
}

void MotionBudget::Start(std::vector<FrontPoint> points) {
  probing_.clear();
  next_ = 0;
  BudgetController::Options options;
  options.budget_ms = budget_ms_;
  if (!points.empty()) controller_.emplace(std::move(points), std::nullopt, options);
}

RadianceSettings MotionBudget::Next(double now_s, bool camera_moved, const RadianceSettings& base) {
  if (!controller_) return base;
  const FrontPoint& point = controller_->Next(now_s, camera_moved);
  if (controller_->Refining()) return base;
  name_ = point.name;
  const RadianceSettings s = WithTradedSettings(base, point.settings);
  return Validate(s).empty() ? s : base;
}

}  // namespace lumi
