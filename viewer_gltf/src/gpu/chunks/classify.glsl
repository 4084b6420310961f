// Colour (not premultiplied) and opacity of a step; `voxels` is its length in voxels for each
// channel. Overlapping channels absorb together and share the colour by their opacities, `shares`.
#if CHANNELS == 1
vec4 classify(vec4 intensity, vec4 voxels, out vec4 shares) {
  shares = vec4(1.0, 0.0, 0.0, 0.0);
  vec4 look = textureLod(uLut, vec2(intensity.x * (255.0 / 256.0) + 0.5 / 256.0, 0.5), 0.0);
  return vec4(look.rgb * uColor[0], 1.0 - pow(1.0 - min(look.a, 0.999), voxels.x));
}
#else
vec4 classify(vec4 intensity, vec4 voxels, out vec4 shares) {
  shares = vec4(0.0);
  vec3 color = vec3(0.0);
  float weight = 0.0;
  float clear = 1.0;
  for (int c = 0; c < CHANNELS; c++) {
    vec2 at = vec2((intensity[c] * 255.0 + 0.5) / 256.0, (float(c) + 0.5) / float(CHANNELS));
    vec4 look = textureLod(uLut, at, 0.0);
    float a = 1.0 - pow(1.0 - min(look.a, 0.999), voxels[c]);
    color += look.rgb * uColor[c] * a;
    weight += a;
    shares[c] = a;
    clear *= 1.0 - a;
  }
  shares /= max(weight, 1e-6);
  return weight > 0.0 ? vec4(color / weight, 1.0 - clear) : vec4(0.0);
}
#endif
