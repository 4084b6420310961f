// Writes depth alone. `part_place` may move `transformed`, `part_end` changes `gl_Position`.
varying vec3 vRoom;
#include <chunks/both_eyes_vertex>
#include <part_declared>

void main() {
  vec3 transformed = position;
  #include <part_place>
  vRoom = (modelMatrix * vec4(transformed, 1.0)).xyz;
  vec4 seen = modelViewMatrix * vec4(transformed, 1.0);
  gl_Position = projectionMatrix * seen;
  toEachEye(seen);
  #include <part_end>
}
