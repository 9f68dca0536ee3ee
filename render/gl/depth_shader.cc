#include <fmt/format.h>

#include "render/gl/blend_shader.h"

namespace lumi {

const std::string& DepthVertexShader() {
  // z = w - 2 near clips at w = near exactly and never behind; the depth that is tested is written by the fragments.
  static const std::string text = fmt::format(R"(#version 430 core
layout(location = 0) in vec3 x_normalized;
uniform vec3 centre;           // of the desired camera, normalised
uniform mat3 clip_from_offset; // rows: x and y in clip units, depth
void main() {{
  vec3 c = clip_from_offset * (x_normalized - centre);
  gl_Position = vec4(c.xy, c.z - 2.0 * {:.9e}, c.z);
}}
)",
                                              kNearDepth);
  return text;
}

std::string DepthFragmentShader(bool faces) {
  // 1/depth is linear on the screen. As a float depth near/depth has the same relative precision at every distance.
  return fmt::format(R"(#version 430 core
layout(location = 0) out float depth;
{}
void main() {{
  depth = 1.0 / gl_FragCoord.w;
  gl_FragDepth = min(1.0, {:.9e} * gl_FragCoord.w);
  {}
}}
)",
                     faces ? "layout(location = 1) out uint face;" : "", kNearDepth,
                     faces ? "face = uint(gl_PrimitiveID) + 1u;" : "");
}

const std::string& FullScreenVertexShader() {
  static const std::string text = R"(#version 430 core
void main() {
  gl_Position = vec4(vec2((gl_VertexID & 1) * 4 - 1, (gl_VertexID & 2) * 2 - 1), 0.0, 1.0);
}
)";
  return text;
}

}  // namespace lumi
