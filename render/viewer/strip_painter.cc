#include "render/viewer/strip_painter.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <chrono>

#include "render/viewer/frame_painter.h"

namespace lumi {

void StripPainter::Start(const RenderRequest& request) {
  request_ = request;
  rows_ = 0;
  begun_ = false;
  spent_ms_ = 0;
}

double StripPainter::fraction() const {
  return request_ ? static_cast<double>(rows_) / std::max(1, request_->view.size_px.y()) : 0.0;
}

std::optional<ImageF> StripPainter::Step(double step_ms, bool undisturbed) {
  if (!request_) return std::nullopt;
  const Eigen::Vector2i size = request_->view.size_px;
  glFinish();
  const auto start = std::chrono::steady_clock::now();
  if (!begun_ || !undisturbed) {
    begun_ = false;
    rows_ = 0;
    spent_ms_ = 0;
    try {
      lumigraph_.Begin(*request_, target_);
    } catch (...) {
      request_.reset();
      throw;
    }
    begun_ = true;
  }
  const int wanted = step_ms <= 0 || InOneGo(request_->settings)
                         ? size.y()
                         : std::max(4, static_cast<int>(step_ms * pixels_per_ms_ / size.x()));
  const int last = std::min(size.y(), rows_ + wanted);
  lumigraph_.Blend(target_, rows_, last);
  glFinish();
  const double ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
  const double rate = static_cast<double>(size.x()) * (last - rows_) / std::max(ms, 1e-3);
  pixels_per_ms_ += 0.5 * (rate - pixels_per_ms_);
  spent_ms_ += ms;
  rows_ = last;
  if (rows_ < size.y()) return std::nullopt;
  request_.reset();
  picture_ms_ = spent_ms_;
  return lumigraph_.ReadColor(target_, size);
}

}  // namespace lumi
