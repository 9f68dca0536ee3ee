#include "render/gl/hole_fill.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <stdexcept>

#include "render/gl/blend_shader.h"

namespace lumi {
namespace {

// Sums of 2 x 2 premultiplied pixels, at most opaque. The last level is one pixel: whatever colour it has, it has at
// full strength.
constexpr const char* kPullHoles = R"(#version 430 core
precision highp float;
precision highp int;
uniform highp sampler2D fine;
uniform ivec2 fine_px;
uniform bool last;
layout(location = 0) out vec4 coarse;
void main() {
  ivec2 first = 2 * ivec2(gl_FragCoord.xy);
  vec4 sum = vec4(0.0);
  for (int dy = 0; dy < 2; ++dy)
    for (int dx = 0; dx < 2; ++dx) {
      ivec2 x = first + ivec2(dx, dy);
      if (x.x < fine_px.x && x.y < fine_px.y) sum += texelFetch(fine, x, 0);
    }
  bool whole = sum.a > 1.0 || (last && sum.a > 0.0);
  coarse = whole ? sum / sum.a : sum;
}
)";

// The coarse level, bilinear; blending puts it under what the finer one has.
constexpr const char* kPushHoles = R"(#version 430 core
precision highp float;
uniform highp sampler2D coarse;
uniform vec2 coarse_px, capacity_px;
layout(location = 0) out vec4 color;
void main() {
  color = texture(coarse, clamp(0.5 * gl_FragCoord.xy, vec2(0.5), coarse_px - 0.5) / capacity_px);
}
)";

// The same under the picture itself, into another texture: the frame stays as it was drawn.
constexpr const char* kFinishHoles = R"(#version 430 core
precision highp float;
uniform highp sampler2D picture, coarse;
uniform vec2 coarse_px, capacity_px;
layout(location = 0) out vec4 color;
void main() {
  vec4 own = texelFetch(picture, ivec2(gl_FragCoord.xy), 0);
  vec4 under = texture(coarse, clamp(0.5 * gl_FragCoord.xy, vec2(0.5), coarse_px - 0.5) / capacity_px);
  color = own.a < 1.0 ? own + (1.0 - own.a) * under : own;
}
)";

Eigen::Vector2i HalfOf(const Eigen::Vector2i& size_px) { return (size_px.array() + 1) / 2; }

void BindTo(int unit, unsigned texture) {
  glActiveTexture(static_cast<GLenum>(GL_TEXTURE0 + unit));
  glBindTexture(GL_TEXTURE_2D, texture);
}

void TellSize(const GlProgram& program, const char* name, const Eigen::Vector2i& px) {
  glUniform2f(program.Uniform(name), static_cast<float>(px.x()), static_cast<float>(px.y()));
}

}  // namespace

GlHoleFill::Level::Level(unsigned format, const Eigen::Vector2i& capacity)
    : texture(MakePictureTexture(format, capacity.x(), capacity.y())),
      framebuffer(GlFramebuffer::Make()),
      capacity_px(capacity) {
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer.id());
  glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, texture.id(), 0);
  if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
    throw std::logic_error("the framebuffer of a level of the fill is incomplete");
  // Texels outside a smaller picture are interpolated with weight 0, which is harmless unless they are NaN.
  const float nothing[4] = {0, 0, 0, 0};
  glDisable(GL_SCISSOR_TEST);
  glClearBufferfv(GL_COLOR, 0, nothing);
}

void GlHoleFill::Reserve(const Eigen::Vector2i& size_px) {
  if (!pull_) {
    pull_ = GlProgram("pull", FullScreenVertexShader(), kPullHoles);
    push_ = GlProgram("push", FullScreenVertexShader(), kPushHoles);
    finish_ = GlProgram("fill", FullScreenVertexShader(), kFinishHoles);
    empty_ = GlVertexArray::Make();
  }
  if ((size_px.array() <= filled_.capacity_px.array()).all()) return;
  Eigen::Vector2i capacity = filled_.capacity_px.cwiseMax(size_px);
  glActiveTexture(GL_TEXTURE0);
  levels_.clear();
  filled_ = Level(GL_RGBA32F, capacity);
  // Half floats: finer than eight bits, interpolated and blended everywhere.
  do {
    capacity = HalfOf(capacity);
    levels_.emplace_back(GL_RGBA16F, capacity);
  } while (capacity.maxCoeff() > 1);
}

void GlHoleFill::Fill(unsigned texture, const Eigen::Vector2i& size_px) {
  if (size_px.minCoeff() <= 0) throw std::invalid_argument("GlHoleFill: the picture has no size");
  GLint before = 0;
  glGetIntegerv(GL_DRAW_FRAMEBUFFER_BINDING, &before);
  Reserve(size_px);
  size_px_ = size_px;
  std::vector<Eigen::Vector2i> sizes{size_px};  // of the picture, and of the levels that it needs
  do sizes.push_back(HalfOf(sizes.back()));
  while (sizes.back().maxCoeff() > 1);
  const std::size_t count = sizes.size() - 1;

  for (const GLenum state : {GL_BLEND, GL_DEPTH_TEST, GL_CULL_FACE, GL_SCISSOR_TEST}) glDisable(state);
  glPolygonMode(GL_FRONT_AND_BACK, GL_FILL);
  glBindVertexArray(empty_.id());
  const auto draw = [&](const Level& to, const Eigen::Vector2i& px) {
    glBindFramebuffer(GL_FRAMEBUFFER, to.framebuffer.id());
    glViewport(0, 0, px.x(), px.y());
    glDrawArrays(GL_TRIANGLES, 0, 3);
  };
  pull_.Use();
  glUniform1i(pull_.Uniform("fine"), 0);
  for (std::size_t l = 0; l < count; ++l) {
    BindTo(0, l == 0 ? texture : levels_[l - 1].texture.id());
    glUniform2i(pull_.Uniform("fine_px"), sizes[l].x(), sizes[l].y());
    glUniform1i(pull_.Uniform("last"), l + 1 == count ? 1 : 0);
    draw(levels_[l], sizes[l + 1]);
  }
  const auto read = [&](const GlProgram& program, int unit, std::size_t l) {
    BindTo(unit, levels_[l].texture.id());
    TellSize(program, "coarse_px", sizes[l + 1]);
    TellSize(program, "capacity_px", levels_[l].capacity_px);
  };
  push_.Use();
  glUniform1i(push_.Uniform("coarse"), 0);
  glEnable(GL_BLEND);
  glBlendFunc(GL_ONE_MINUS_DST_ALPHA, GL_ONE);
  for (std::size_t l = count - 1; l > 0; --l) {
    read(push_, 0, l);
    draw(levels_[l - 1], sizes[l]);
  }
  glDisable(GL_BLEND);
  finish_.Use();
  glUniform1i(finish_.Uniform("picture"), 0);
  glUniform1i(finish_.Uniform("coarse"), 1);
  read(finish_, 1, 0);
  BindTo(0, texture);
  draw(filled_, size_px);
  glBindVertexArray(0);
  glBindFramebuffer(GL_FRAMEBUFFER, static_cast<GLuint>(before));
  CheckGl("filling holes");
}

}  // namespace lumi
