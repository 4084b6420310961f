// Intensity of each channel, 0..1, at a texture coordinate.
vec4 sampleIntensities(vec3 p) {
  vec4 v = vec4(0.0);
  v.x = texture(uVolume0, p).r;
#if CHANNELS > 1
  v.y = texture(uVolume1, p).r;
#endif
#if CHANNELS > 2
  v.z = texture(uVolume2, p).r;
#endif
#if CHANNELS > 3
  v.w = texture(uVolume3, p).r;
#endif
  return v;
}
