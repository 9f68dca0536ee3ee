layout(location = 0) out vec4 depth;  // along the optical axis, and the face's normal
flat in vec3 normal;
void main() {
  depth = vec4(1.0 / gl_FragCoord.w, normal);
  gl_FragDepth = min(1.0, NEAR_DEPTH * gl_FragCoord.w);  // tested as greater: the same relative precision at every distance
}
