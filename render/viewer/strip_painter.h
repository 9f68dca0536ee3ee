// Draws one picture besides the one shown, in steps short enough that the window stays responsive: a video's frame, or
// a photo's view for measuring an error.
#pragma once

#include <optional>

#include "render/gl/gl_lumigraph.h"
#include "render/world/renderer.h"

namespace lumi {

class StripPainter {
 public:
  // Must outlive the painter. The current context's thread.
  explicit StripPainter(GlLumigraph& lumigraph) : lumigraph_(lumigraph) {}

  void Start(const RenderRequest& request);
  bool busy() const { return request_.has_value(); }
  void Cancel() { request_.reset(); }

  // Draws for about step_ms (<= 0: to the end). `undisturbed`: nothing else was begun on the lumigraph since the last
  // step; else the picture starts again. Returns the finished picture. Throws what GlLumigraph::Begin throws, and is
  // idle then.
  std::optional<ImageF> Step(double step_ms, bool undisturbed);
  double picture_ms() const { return picture_ms_; }  // that the last finished picture took
  double fraction() const;                           // of the picture's rows that are drawn

 private:
  GlLumigraph& lumigraph_;
  GlTarget target_;
  std::optional<RenderRequest> request_;
  int rows_ = 0;
  bool begun_ = false;
  double pixels_per_ms_ = 1000;  // until measured: a slow machine's
  double spent_ms_ = 0, picture_ms_ = 0;
};

}  // namespace lumi
