// The picture on the screen: its first row is the top one.
layout(location = 0) out vec4 color;
uniform sampler2D picture;  // premultiplied
uniform vec2 canvas_px;
uniform vec3 ground;
uniform int proxy;          // 1: the proxy's faces, by their normals
uniform sampler2D depth_map;
void main() {
  vec2 x = gl_FragCoord.xy / canvas_px;
  x.y = 1.0 - x.y;
  if (proxy == 1) {
    vec4 d = texelFetch(depth_map, ivec2(x * vec2(textureSize(depth_map, 0))), 0);
    color = vec4(d.r > 0.0 ? 0.5 + 0.45 * d.yzw : ground, 1.0);
    return;
  }
  vec4 c = texture(picture, x);
  color = vec4(c.rgb + (1.0 - c.a) * ground, 1.0);
}
