#include "render/viewer/overlay.h"

#include <epoxy/gl.h>

#include "render/gl/blend_shader.h"

namespace lumi {
namespace {

constexpr const char* kPresent = R"(#version 430 core
layout(location = 0) out vec4 color;
uniform sampler2D picture;
uniform vec2 picture_px, capacity_px, window_px;
void main() {
  // The picture's first row is its top.
  vec2 x = vec2(gl_FragCoord.x, window_px.y - gl_FragCoord.y) / window_px * picture_px;
  vec4 c = texture(picture, clamp(x, vec2(0.5), picture_px - 0.5) / capacity_px);
  vec2 cell = abs(fract(gl_FragCoord.xy / 40.0) - 0.5);
  float line = smoothstep(0.475, 0.49, max(cell.x, cell.y));
  vec3 backdrop = mix(vec3(0.115, 0.12, 0.13), vec3(0.15, 0.157, 0.17), line);
  color = vec4(c.rgb + (1.0 - c.a) * backdrop, 1.0);
}
)";

constexpr const char* kLineVertex = R"(#version 430 core
layout(location = 0) in vec3 x_normalized;
layout(location = 1) in vec4 line_color;
uniform vec3 centre;
uniform mat3 clip_from_offset;
uniform float near_depth;
out vec4 rgba;
void main() {
  vec3 c = clip_from_offset * (x_normalized - centre);
  gl_Position = vec4(c.x, -c.y, c.z - 2.0 * near_depth, c.z);
  rgba = line_color;
}
)";

constexpr const char* kLineFragment = R"(#version 430 core
layout(location = 0) out vec4 color;
in vec4 rgba;
uniform sampler2D depth_map;
uniform vec2 picture_px, window_px;
void main() {
  vec2 x = vec2(gl_FragCoord.x, window_px.y - gl_FragCoord.y) / window_px * picture_px;
  float surface = texelFetch(depth_map, clamp(ivec2(x), ivec2(0), ivec2(picture_px) - 1), 0).r;
  float depth = 1.0 / gl_FragCoord.w;
  bool hidden = surface > 0.0 && depth > surface * 1.01;
  color = vec4(rgba.rgb, hidden ? 0.18 * rgba.a : rgba.a);
}
)";

void SetVector(const GlProgram& p, const char* name, const Eigen::Vector2i& v) {
  glUniform2f(p.Uniform(name), static_cast<float>(v.x()), static_cast<float>(v.y()));
}

}  // namespace

Overlay::Overlay()
    : present_("present", FullScreenVertexShader(), kPresent),
      lines_("lines", kLineVertex, kLineFragment),
      empty_(GlVertexArray::Make()),
      line_array_(GlVertexArray::Make()),
      line_buffer_(GlBuffer::Make()) {
  constexpr GLsizei kStride = 7 * sizeof(float);
  glBindVertexArray(line_array_.id());
  glBindBuffer(GL_ARRAY_BUFFER, line_buffer_.id());
  glEnableVertexAttribArray(0);
  glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, kStride, nullptr);
  glEnableVertexAttribArray(1);
  glVertexAttribPointer(1, 4, GL_FLOAT, GL_FALSE, kStride, reinterpret_cast<const void*>(3 * sizeof(float)));
  glBindVertexArray(0);
  CheckGl("preparing the overlays");
}

void Overlay::Present(const GlTarget& target, const Eigen::Vector2i& picture_px, const Eigen::Vector2i& window_px) {
  Present(target.color_texture(), target.capacity_px(), picture_px, window_px);
}

void Overlay::Present(unsigned texture, const Eigen::Vector2i& capacity_px, const Eigen::Vector2i& picture_px,
                      const Eigen::Vector2i& window_px) {
  glViewport(0, 0, window_px.x(), window_px.y());
  glDisable(GL_BLEND);
  glDisable(GL_DEPTH_TEST);
  glDisable(GL_SCISSOR_TEST);
  present_.Use();
  SetVector(present_, "picture_px", picture_px);
  SetVector(present_, "capacity_px", capacity_px);
  SetVector(present_, "window_px", window_px);
  glUniform1i(present_.Uniform("picture"), 0);
  glActiveTexture(GL_TEXTURE0);
  glBindTexture(GL_TEXTURE_2D, texture);
  glBindVertexArray(empty_.id());
  glDrawArrays(GL_TRIANGLES, 0, 3);
  glBindVertexArray(0);
}

void Overlay::PresentNothing(const Eigen::Vector2i& window_px) {
  glViewport(0, 0, window_px.x(), window_px.y());
  glDisable(GL_SCISSOR_TEST);
  glClearColor(0.115F, 0.12F, 0.13F, 1);
  glClear(GL_COLOR_BUFFER_BIT);
}

void Overlay::UseLines(const Eye& eye) {
  glViewport(0, 0, eye.window_px.x(), eye.window_px.y());
  glDisable(GL_DEPTH_TEST);
  glDisable(GL_SCISSOR_TEST);
  glEnable(GL_BLEND);
  glBlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
  UseFor(lines_, eye.view.P.leftCols<3>() / eye.view.P.row(2).head<3>().norm(), eye.view);
  glUniform1f(lines_.Uniform("near_depth"), 100 * kNearDepth);
  glUniform1i(lines_.Uniform("depth_map"), 0);
  SetVector(lines_, "picture_px", eye.picture_px);
  SetVector(lines_, "window_px", eye.window_px);
  glActiveTexture(GL_TEXTURE0);
  glBindTexture(GL_TEXTURE_2D, eye.target->depth_texture());
}

void Overlay::Frusta(const Eye& eye, const Sources& sources, const std::vector<Eigen::Vector4f>& colors,
                     const std::vector<int>& quarter_turns, double depth) {
  std::vector<Line> lines;
  for (std::size_t j = 0; j < sources.views.size(); ++j) {
    const std::array<Eigen::Vector3d, 4> corner = AddFrustum(sources.views[j], depth, colors[j], lines);
    // A tick on the upper side says which way is up in the photo.
    // Corners go round clockwise: upright, the photo's upper left one is this one.
    const auto left = static_cast<std::size_t>(4 - quarter_turns[j]) % 4, right = (left + 1) % 4;
    const Eigen::Vector3d tick = 0.5 * (corner[left] + corner[right]) + 0.2 * (corner[left] - corner[(left + 3) % 4]);
    lines.push_back({corner[left], tick, colors[j]});
    lines.push_back({tick, corner[right], colors[j]});
  }
  Lines(eye, lines);
}

std::array<Eigen::Vector3d, 4> Overlay::AddFrustum(const RenderView& view, double depth, const Eigen::Vector4f& color,
                                                   std::vector<Line>& lines) {
  const std::array<Eigen::Vector3d, 4> corner = CornersAt(view, depth);
  for (std::size_t c = 0; c < 4; ++c) {
    lines.push_back({view.centre, corner[c], color});
    lines.push_back({corner[c], corner[(c + 1) % 4], color});
  }
  return corner;
}

void Overlay::Lines(const Eye& eye, const std::vector<Line>& lines) {
  if (lines.empty()) return;
  std::vector<float> vertices;
  for (const Line& line : lines)
    for (const Eigen::Vector3d& x : {line.a, line.b}) {
      for (int c = 0; c < 3; ++c) vertices.push_back(static_cast<float>(x[c]));
      for (int c = 0; c < 4; ++c) vertices.push_back(line.color[c]);
    }
  UseLines(eye);
  glBindVertexArray(line_array_.id());
  FillBuffer(GL_ARRAY_BUFFER, line_buffer_, vertices);
  glDrawArrays(GL_LINES, 0, static_cast<GLsizei>(2 * lines.size()));
  glBindVertexArray(0);
  glDisable(GL_BLEND);
  CheckGl("drawing lines over the picture");
}

void Overlay::ProxyEdges(const Eye& eye, const GlLumigraph& lumigraph) {
  if (lumigraph.proxy_index_count() == 0) return;
  UseLines(eye);
  glBindVertexArray(lumigraph.proxy_vertex_array());
  glVertexAttrib4f(1, 0.55F, 0.80F, 1.0F, 0.3F);
  glPolygonMode(GL_FRONT_AND_BACK, GL_LINE);
  glDrawElements(GL_TRIANGLES, lumigraph.proxy_index_count(), GL_UNSIGNED_INT, nullptr);
  glPolygonMode(GL_FRONT_AND_BACK, GL_FILL);
  glBindVertexArray(0);
  glDisable(GL_BLEND);
  CheckGl("drawing the proxy's edges");
}

}  // namespace lumi
