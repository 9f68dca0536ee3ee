// A picture from elsewhere on the graphics processor, to be shown in the window.
#pragma once

#include <Eigen/Core>

#include "render/gl/gl_objects.h"
#include "scene/model/image.h"

namespace lumi {

class PictureTexture {
 public:
  // RGBA, premultiplied. Replaces the one before.
  void Set(const ImageF& picture);
  void Clear() { texture_ = {}; }
  bool empty() const { return !texture_; }
  unsigned texture() const { return texture_.id(); }
  const Eigen::Vector2i& size_px() const { return size_px_; }

 private:
  GlTexture texture_;
  Eigen::Vector2i size_px_ = Eigen::Vector2i::Zero();
};

}  // namespace lumi
