// Where a lumigraph's picture is drawn.
#pragma once

#include <Eigen/Core>

#include "render/gl/gl_objects.h"

namespace lumi {

// RGBA float, premultiplied, first row on top; and the depth along the optical axis in
// normalised units (0: the proxy is missed). Grows, never shrinks.
class GlTarget {
 public:
  // With `faces`: room for the proxy's face at each pixel, too.
  void Reserve(const Eigen::Vector2i& size_px, bool faces = false);
  const Eigen::Vector2i& capacity_px() const { return capacity_px_; }
  unsigned depth_framebuffer() const { return depth_framebuffer_.id(); }
  unsigned color_framebuffer() const { return color_framebuffer_.id(); }
  unsigned both_framebuffer() const { return both_framebuffer_.id(); }  // colour, and depth as a second colour
  unsigned depth_texture() const { return depth_.id(); }
  unsigned color_texture() const { return color_.id(); }
  unsigned face_texture() const { return face_.id(); }

 private:
  Eigen::Vector2i capacity_px_ = Eigen::Vector2i::Zero();
  GlTexture depth_, depth_test_, color_, face_;
  GlFramebuffer depth_framebuffer_, color_framebuffer_, both_framebuffer_;
};

}  // namespace lumi
