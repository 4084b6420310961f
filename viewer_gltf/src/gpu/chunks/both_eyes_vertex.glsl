// For vertex shaders: a scene is drawn once for both eyes, as two instances, each in its eye's part
// of the frame.
varying float vEye;  // 0 left, 1 right; -1: one eye sees the whole frame
uniform bool uIsForBoth;
uniform mat4 uEyeClip[2];  // from the space between the eyes to the clip space of the whole frame

// Call it after `gl_Position` is set. `seen`: the position in the space between the eyes.
void toEachEye(vec4 seen) {
  vEye = -1.0;
  if (uIsForBoth) {
    vEye = float(gl_InstanceID);
    gl_Position = uEyeClip[gl_InstanceID] * seen;
  }
}
