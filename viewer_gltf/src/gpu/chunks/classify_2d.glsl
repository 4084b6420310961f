// Whether any channel shows this intensity at some gradient. If not, the gradient need not be
// computed.
bool mayShow(vec4 intensity) {
  float most = 0.0;
  for (int c = 0; c < CHANNELS; c++) {
    vec2 at = vec2((intensity[c] * 255.0 + 0.5) / 256.0, (float(c) + 0.5) / float(CHANNELS));
    most = max(most, texture(uLut, at).a);
  }
  return most > 0.0;
}

// Like `classify`, by tables of intensity and steepness, one layer for each channel.
vec4 classify2d(vec4 intensity, vec4 steepness, vec4 voxels, out vec4 shares) {
  shares = vec4(0.0);
  vec3 color = vec3(0.0);
  float weight = 0.0;
  float clear = 1.0;
  for (int c = 0; c < CHANNELS; c++) {
    vec2 at = (vec2(intensity[c], steepness[c]) * vec2(255.0, 63.0) + 0.5) / vec2(256.0, 64.0);
    vec4 look = texture(uTables2d, vec3(at, float(c)));
    float a = 1.0 - pow(1.0 - min(look.a, 0.999), voxels[c]);
    color += look.rgb * uColor[c] * a;
    weight += a;
    shares[c] = a;
    clear *= 1.0 - a;
  }
  shares /= max(weight, 1e-6);
  return weight > 0.0 ? vec4(color / weight, 1.0 - clear) : vec4(0.0);
}
