#include "render/viewer/canvas.h"

#include <epoxy/gl.h>

#include <algorithm>

namespace lumi {

Canvas::Canvas(const Eigen::Vector2i& size_px)
    : size_px_(size_px),
      color_(MakePictureTexture(GL_RGBA8, size_px.x(), size_px.y())),
      framebuffer_(GlFramebuffer::Make()) {
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_.id());
  glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, color_.id(), 0);
}

Image8 Canvas::Read() const {
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_.id());
  Image8 bottom_up(size_px_.x(), size_px_.y(), 3), image(size_px_.x(), size_px_.y(), 3);
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(0, 0, size_px_.x(), size_px_.y(), GL_RGB, GL_UNSIGNED_BYTE, bottom_up.data.data());
  CheckGl("taking a screenshot");
  for (int y = 0; y < image.height; ++y)
    std::copy_n(bottom_up.Row(image.height - 1 - y), 3 * image.width, image.Row(y));
  return image;
}

}  // namespace lumi
