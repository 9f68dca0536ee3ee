// The proxy's faces, flat-shaded by a lamp at the viewer's head: what the photos are blended over (Fig. 5-14).
#pragma once

#include <Eigen/Core>

#include "render/gl/gl_lumigraph.h"

namespace lumi {

class FlatSurface {
 public:
  FlatSurface();
  // Into a texture of its own; the framebuffer that is bound stays. view: in the lumigraph's normalised frame.
  void Draw(const RenderView& view, const GlLumigraph& lumigraph);
  unsigned texture() const { return color_.id(); }  // first row on top, premultiplied; transparent beside the proxy
  const Eigen::Vector2i& size_px() const { return size_px_; }

 private:
  GlProgram program_;
  GlTexture color_, depth_;
  GlFramebuffer framebuffer_;
  Eigen::Vector2i size_px_ = Eigen::Vector2i::Zero();
};

}  // namespace lumi
