// Holes of a picture filled smoothly from around them on the graphics processor, for frames that are shown and never
// leave it: FillSmoothly (render/picture/border_fill.h), a pass over half as many pixels a side for each level down and
// up.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "render/gl/gl_objects.h"

namespace lumi {

class GlHoleFill {
 public:
  // The first size_px pixels of `texture`, RGBA and premultiplied, which stays as it is. Nothing is read back: a
  // picture without holes takes as long. Leaves the framebuffer bound that was bound before.
  void Fill(unsigned texture, const Eigen::Vector2i& size_px);

  // The filled picture, opaque, in the first size_px() pixels of a texture that grows and never shrinks; what was
  // opaque is the same to the last bit. A picture without any colour stays empty.
  unsigned texture() const { return filled_.texture.id(); }
  const Eigen::Vector2i& size_px() const { return size_px_; }
  const Eigen::Vector2i& capacity_px() const { return filled_.capacity_px; }

 private:
  struct Level {
    Level(unsigned format, const Eigen::Vector2i& capacity_px);
    Level() = default;
    GlTexture texture;
    GlFramebuffer framebuffer;
    Eigen::Vector2i capacity_px = Eigen::Vector2i::Zero();
  };

  void Reserve(const Eigen::Vector2i& size_px);

  Level filled_;
  std::vector<Level> levels_;  // each half of the one before
  Eigen::Vector2i size_px_ = Eigen::Vector2i::Zero();
  GlProgram pull_, push_, finish_;
  GlVertexArray empty_;
};

}  // namespace lumi
