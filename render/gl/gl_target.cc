#include "render/gl/gl_target.h"

#include <epoxy/gl.h>

#include <stdexcept>
#include <string>

#include "scene/program/error.h"

namespace lumi {
namespace {

void MakeTexture(GlTexture& texture, GLenum format, const Eigen::Vector2i& size) {
  texture = GlTexture::Make();
  glBindTexture(GL_TEXTURE_2D, texture.id());
  glTexStorage2D(GL_TEXTURE_2D, 1, format, size.x(), size.y());
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
}

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
  MakeTexture(depth_, GL_R32F, capacity_px_);
  MakeTexture(depth_test_, GL_DEPTH_COMPONENT32F, capacity_px_);
  MakeTexture(color_, GL_RGBA32F, capacity_px_);
  if (faces || face_) {
    MakeTexture(face_, GL_R32UI, capacity_px_);
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
