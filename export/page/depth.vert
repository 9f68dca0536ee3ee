// Twin of render/gl/depth_shader.cc: a near plane at NEAR_DEPTH and none behind.
layout(location = 0) in vec3 x_normalized;
layout(location = 1) in vec3 face_normal;
uniform vec3 centre;
uniform mat3 clip_from_offset;
flat out vec3 normal;
void main() {
  vec3 c = clip_from_offset * (x_normalized - centre);
  gl_Position = vec4(c.xy, c.z - 2.0 * NEAR_DEPTH, c.z);
  normal = face_normal;
}
