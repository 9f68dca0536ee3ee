#include "render/gl/gl_target.h"

#include <epoxy/gl.h>

#include <stdexcept>
#include <string>

#include "scene/program/error.h"

namespace lumi {
namespace {

void RequireComplete() {
  const GLenum status = glCheckFramebufferStatus(GL_FRAMEBUFFER);
  if (status != GL_FRAMEBUFFER_COMPLETE) throw std::logic_error("an OpenGL framebuffer is incomplete");
}

}  // namespace

void GlTarget::Reserve(const Eigen::Vector2i& size_px, bool faces) {
  if ((size_px.array() <= capacity_px_.array()).all() && (!faces || face_)) return;
  GLint max_size = 16384;
  glGetIntegerv(GL_MAX_TEXTURE_SIZE, &max_size);
  if (size_px.maxCoeff() > max_size)
    throw MachineError("a picture of " + std::to_string(size_px.x()) + "x" + std::to_string(size_px.y()) +
                           " is larger than this driver's textures (" + std::to_string(max_size) + ")",
                       "use --backend cpu");
  capacity_px_ = capacity_px_.cwiseMax(size_px).eval();
  glActiveTexture(GL_TEXTURE0);
  const int width = capacity_px_.x(), height = capacity_px_.y();
  depth_ = MakePictureTexture(GL_R32F, width, height);
  depth_test_ = MakePictureTexture(GL_DEPTH_COMPONENT32F, width, height);
  color_ = MakePictureTexture(GL_RGBA32F, width, height);
  if (faces || face_) {
    face_ = MakePictureTexture(GL_R32UI, width, height);
    // Whole numbers are not interpolated: with any other filter the texture is incomplete.
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
  }
  const auto make = [&](GlFramebuffer& framebuffer, const GlTexture& first, const GlTexture* second) {
    framebuffer = GlFramebuffer::Make();
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer.id());
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, first.id(), 0);
    if (second != nullptr) glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT1, GL_TEXTURE_2D, second->id(), 0);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D, depth_test_.id(), 0);
    const GLenum buffers[2] = {GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1};
    glDrawBuffers(second != nullptr ? 2 : 1, buffers);
    RequireComplete();
  };
  make(depth_framebuffer_, depth_, face_ ? &face_ : nullptr);
  make(color_framebuffer_, color_, nullptr);
  make(both_framebuffer_, color_, &depth_);
  CheckGl("making room for a picture");
}

}  // namespace lumi
