// Keeps the picture responsive: while anything moves, it is drawn as large as the time allows; at rest it is refined to
// full resolution, some rows per frame, so that the next move is shown at once.
#pragma once

#include "render/gl/gl_lumigraph.h"
#include "render/world/renderer.h"

namespace lumi {

struct PainterOptions {
  double moving_ms = 45;     // a picture while moving
  double refine_ms = 40;     // rows of the full picture a frame, at rest
  double min_scale = 0.125;  // of the window's side
};

// Interpolated samples are triangles: each strip would pay for all of them, so their picture is drawn in one go.
inline bool InOneGo(const RadianceSettings& s) { return s.Sparse() && s.sampling == Sampling::kInterpolated; }

class FramePainter {
 public:
  // Must outlive the painter. The current context's thread.
  FramePainter(GlLumigraph& lumigraph, const PainterOptions& options);

  // One frame's work on the picture of `full`; `preview` is the same at PreviewSize, perhaps with cheaper settings.
  // changed: it is another picture than at the last call; may_refine: false puts the full resolution off (the picture
  // is about to change anyway). Throws what GlLumigraph::Begin throws; what is shown stays.
  void Paint(const RenderRequest& full, const RenderRequest& preview, bool changed, bool may_refine);

  // The size that a moving picture has in a window of this size.
  Eigen::Vector2i PreviewSize(const Eigen::Vector2i& full_px) const;

  // Tells the painter that something else was begun on the lumigraph: a half-refined picture starts again.
  void Disturbed() { begun_ = false; }
  void SetMovingTime(double ms) { options_.moving_ms = ms; }

  bool complete() const { return complete_; }  // what is shown is at full resolution
  bool empty() const { return shown_ == nullptr; }
  const GlTarget& shown() const { return *shown_; }
  const Eigen::Vector2i& shown_size_px() const { return shown_size_px_; }
  // Time of the preview that the last call drew, scaled to full size; 0 if it drew none.
  double preview_ms() const { return preview_ms_; }
  double picture_ms() const { return picture_ms_; }  // of the last picture, in one go or in strips
  bool painted() const { return painted_; }          // the last call drew something

 private:
  double Timed(const RenderRequest& request, GlTarget& target, int first_row, int last_row, bool begin, double& rate);

  GlLumigraph& lumigraph_;
  PainterOptions options_;
  GlTarget preview_, full_;
  const GlTarget* shown_ = nullptr;
  Eigen::Vector2i shown_size_px_ = Eigen::Vector2i::Zero();
  double moving_rate_, refining_rate_;  // pixels a millisecond: the two may be drawn by different settings
  int refined_rows_ = 0;
  bool complete_ = false, painted_ = false, begun_ = false;
  double picture_ms_ = 0, refining_ms_ = 0, preview_ms_ = 0;
};

}  // namespace lumi
