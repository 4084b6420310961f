// Scales down light that is brighter than the screen, keeping its hue; the brighter it is, the more
// it tends to white. Light that the screen can show is unchanged.
vec3 withinGamut(vec3 light) {
  light = max(light, 0.0);
  float peak = max(light.r, max(light.g, light.b));
  if (peak <= 1.0) return light;
  return mix(vec3(1.0), light / peak, 1.0 / (1.0 + 0.5 * (peak - 1.0)));
}
