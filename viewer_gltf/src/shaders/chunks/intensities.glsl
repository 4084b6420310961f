// Intensity of each channel, 0..1, at a texture coordinate.
vec4 sampleIntensities(vec3 p) {
  vec4 v = texture(uVolume, p);
  return uFresh < 1.0 ? mix(texture(uOldVolume, p), v, uFresh) : v;
}
