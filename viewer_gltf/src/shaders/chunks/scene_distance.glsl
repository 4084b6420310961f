// Distance along this fragment's ray to the opaque surface behind this pixel, in the ray's own
// units: view z grows linearly along the ray and is vViewZ at distance `back`.
float sceneDistance(float back) {
  float depth = texelFetch(uSceneDepth, ivec2(gl_FragCoord.xy), 0).r;
  float viewZ = -vDepth.y / (2.0 * depth - 1.0 + vDepth.x);
  return back * viewZ / vViewZ;
}
