// Writes depth only. A part may move `transformed` for some surfaces, and change `gl_Position` at
// the end.
varying vec3 vScene;
#include <chunks/both_eyes_vertex>
#include <part/vertex_declared>

void main() {
  vec3 transformed = position;
  #include <part/vertex_place>
  vScene = (modelMatrix * vec4(transformed, 1.0)).xyz;
  vec4 seen = modelViewMatrix * vec4(transformed, 1.0);
  gl_Position = projectionMatrix * seen;
  toEachEye(seen);
  #include <part/vertex_end>
}
