// Light that is brighter than the screen keeps its hue: it is scaled down, and the more of it there
// was, the nearer it comes to white. Light that the screen can show is left as it is.
vec3 withinGamut(vec3 light) {
  light = max(light, 0.0);
  float peak = max(light.r, max(light.g, light.b));
  if (peak <= 1.0) return light;
  return mix(vec3(1.0), light / peak, 1.0 / (1.0 + 0.5 * (peak - 1.0)));
}
