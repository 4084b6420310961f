// In a vertex shader, a scene is drawn once for both eyes: as two instances, each in its eye's part of the picture.
varying float vEye;  // 0 left, 1 right; -1: one eye sees all of the picture
uniform bool uIsForBoth;
uniform mat4 uEyeClip[2];  // from what is seen between the eyes to the clip space of the whole picture

// Call it after `gl_Position` is set. `seen`: the place as it is seen between the eyes.
void toEachEye(vec4 seen) {
  vEye = -1.0;
  if (uIsForBoth) {
    vEye = float(gl_InstanceID);
    gl_Position = uEyeClip[gl_InstanceID] * seen;
  }
}
