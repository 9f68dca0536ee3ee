// A framebuffer for screenshots: a window's own pixels may be covered.
#pragma once

#include <Eigen/Core>

#include "render/gl/gl_objects.h"
#include "scene/model/image.h"

namespace lumi {

class Canvas {
 public:
  // Leaves its framebuffer bound.
  explicit Canvas(const Eigen::Vector2i& size_px);
  Image8 Read() const;

 private:
  Eigen::Vector2i size_px_;
  GlTexture color_;
  GlFramebuffer framebuffer_;
};

}  // namespace lumi
