#include "render/viewer/flat_surface.h"

#include <epoxy/gl.h>

#include "render/gl/blend_shader.h"

namespace lumi {
namespace {

constexpr const char* kVertex = R"(#version 430 core
layout(location = 0) in vec3 x_normalized;
uniform vec3 centre;
uniform mat3 clip_from_offset;
uniform float near_depth;
out vec3 offset;
void main() {
  offset = x_normalized - centre;
  vec3 c = clip_from_offset * offset;
  gl_Position = vec4(c.xy, c.z - 2.0 * near_depth, c.z);
}
)";

// The face's normal from its own plane: no vertex normals, so every facet shows.
constexpr const char* kFragment = R"(#version 430 core
layout(location = 0) out vec4 color;
in vec3 offset;
uniform float near_depth;
void main() {
  gl_FragDepth = min(1.0, near_depth * gl_FragCoord.w);
  vec3 n = cross(dFdx(offset), dFdy(offset));
  float shade = length(n) > 0.0 ? abs(dot(normalize(n), normalize(offset))) : 0.0;
  vec3 base = gl_FrontFacing ? vec3(0.86, 0.87, 0.90) : vec3(0.85, 0.38, 0.33);
  color = vec4(base * (0.18 + 0.82 * shade), 1.0);
}
)";

}  // namespace

FlatSurface::FlatSurface() : program_("flat surface", kVertex, kFragment), framebuffer_(GlFramebuffer::Make()) {}

void FlatSurface::Draw(const RenderView& view, const GlLumigraph& lumigraph) {
  int before = 0;
  glGetIntegerv(GL_DRAW_FRAMEBUFFER_BINDING, &before);
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_.id());
  if (size_px_ != view.size_px) {
    size_px_ = view.size_px;
    const auto make = [&](GlTexture& texture, GLenum format, GLenum attachment) {
      texture = MakePictureTexture(format, size_px_.x(), size_px_.y());
      glFramebufferTexture2D(GL_FRAMEBUFFER, attachment, GL_TEXTURE_2D, texture.id(), 0);
    };
    glActiveTexture(GL_TEXTURE0);
    make(color_, GL_RGBA8, GL_COLOR_ATTACHMENT0);
    make(depth_, GL_DEPTH_COMPONENT32F, GL_DEPTH_ATTACHMENT);
  }
  glViewport(0, 0, size_px_.x(), size_px_.y());
  glDisable(GL_SCISSOR_TEST);
  glDisable(GL_BLEND);
  glEnable(GL_DEPTH_TEST);
  glDepthMask(GL_TRUE);
  glDepthFunc(GL_GREATER);  // near / depth: larger is nearer
  glClearColor(0, 0, 0, 0);
  glClearDepth(0);
  glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  UseFor(program_, view.P.leftCols<3>() / view.P.row(2).head<3>().norm(), view);
  glUniform1f(program_.Uniform("near_depth"), kNearDepth);
  glFrontFace(GL_CW);  // the first row is the top: what runs counter-clockwise for the viewer runs clockwise here
  glBindVertexArray(lumigraph.proxy_vertex_array());
  glDrawElements(GL_TRIANGLES, lumigraph.proxy_index_count(), GL_UNSIGNED_INT, nullptr);
  glBindVertexArray(0);
  glFrontFace(GL_CCW);
  glDisable(GL_DEPTH_TEST);
  glDepthFunc(GL_LESS);
  glBindFramebuffer(GL_FRAMEBUFFER, static_cast<GLuint>(before));
  CheckGl("drawing the proxy");
}

}  // namespace lumi
