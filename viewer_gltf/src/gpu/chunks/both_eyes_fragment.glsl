// In a fragment shader of a scene that is drawn for both eyes; see both_eyes_vertex.glsl.
varying float vEye;
uniform float uMiddle;  // where the right eye's part of the frame begins, pixels

// Discards a fragment that reaches into the other eye's part of the frame.
void keepToOwnEye() {
  if (vEye >= 0.0 && (gl_FragCoord.x < uMiddle) != (vEye < 0.5)) discard;
}
