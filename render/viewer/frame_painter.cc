#include "render/viewer/frame_painter.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <chrono>
#include <cmath>

namespace lumi {
namespace {

// Rates assumed before anything was measured: for two CPU cores, and for any graphics processor.
constexpr double kSoftwarePixelsPerMs = 1500;
constexpr double kHardwarePixelsPerMs = 1e6;
// From this scale on, the preview is drawn at full size: a second resolution would not pay.
constexpr double kNearlyFull = 0.85;

}  // namespace

FramePainter::FramePainter(GlLumigraph& lumigraph, const PainterOptions& options)
    : lumigraph_(lumigraph),
      options_(options),
      moving_rate_(GlIsSoftware() ? kSoftwarePixelsPerMs : kHardwarePixelsPerMs),
      refining_rate_(moving_rate_) {}

Eigen::Vector2i FramePainter::PreviewSize(const Eigen::Vector2i& full) const {
  const double scale = std::sqrt(options_.moving_ms * moving_rate_ / (static_cast<double>(full.x()) * full.y()));
  if (scale >= kNearlyFull) return full;
  const double limited = std::max(scale, options_.min_scale);
  return {std::max(1, static_cast<int>(full.x() * limited)), std::max(1, static_cast<int>(full.y() * limited))};
}

double FramePainter::Timed(const RenderRequest& request, GlTarget& target, int first_row, int last_row, bool begin,
                           double& rate) {
  // Wall clock around a finished command stream: GPU timers are wrong on software drivers.
  glFinish();
  const auto start = std::chrono::steady_clock::now();
  if (begin) lumigraph_.Begin(request, target);
  lumigraph_.Blend(target, first_row, last_row);
  glFinish();
  const double ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
  const double now = static_cast<double>(request.view.size_px.x()) * (last_row - first_row) / std::max(ms, 1e-3);
  rate += 0.3 * (now - rate);
  painted_ = true;
  return ms;
}

void FramePainter::Paint(const RenderRequest& request, const RenderRequest& preview, bool changed, bool may_refine) {
  painted_ = false;
  preview_ms_ = 0;
  const Eigen::Vector2i full = request.view.size_px;
  if (changed || shown_ == nullptr) {
    const bool at_once = preview.view.size_px == full && preview.settings == request.settings;
    begun_ = false;
    GlTarget& target = at_once ? full_ : preview_;
    const double ms = Timed(preview, target, 0, preview.view.size_px.y(), true, moving_rate_);
    preview_ms_ = ms * static_cast<double>(full.prod()) / static_cast<double>(preview.view.size_px.prod());
    if (at_once) picture_ms_ = ms;
    if (preview.settings == request.settings) refining_rate_ = moving_rate_;
    shown_ = &target;
    shown_size_px_ = preview.view.size_px;
    complete_ = at_once;
    return;
  }
  if (complete_ || !may_refine) return;
  if (!begun_) {
    refined_rows_ = 0;
    refining_ms_ = 0;
  }
  // Draws rows of the full picture into its own target, while the preview is shown.
  const double rows = InOneGo(request.settings) ? full.y() : options_.refine_ms * refining_rate_ / full.x();
  const int last = std::min(full.y(), refined_rows_ + std::max(4, static_cast<int>(rows)));
  refining_ms_ += Timed(request, full_, refined_rows_, last, !begun_, refining_rate_);
  begun_ = true;
  refined_rows_ = last;
  if (refined_rows_ == full.y()) {
    shown_ = &full_;
    shown_size_px_ = full;
    complete_ = true;
    picture_ms_ = refining_ms_;
  }
}

}  // namespace lumi
