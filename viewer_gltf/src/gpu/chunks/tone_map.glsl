// Steps after the lighting: tone map, then hue, saturation and lightness of the encoded colour.

// Film curve, fitted by Narkowicz 2015 to that of the Academy (ACES).
vec3 filmic(vec3 c) {
  return clamp(c * (2.51 * c + 0.03) / (c * (2.43 * c + 0.59) + 0.14), 0.0, 1.0);
}

// Hue in turns; saturation and lightness 0 to 1 (Joblove & Greenberg 1978).
vec3 hslOf(vec3 c) {
  float high = max(c.r, max(c.g, c.b));
  float low = min(c.r, min(c.g, c.b));
  float range = high - low;
  float lightness = 0.5 * (high + low);
  if (range < 1e-6) return vec3(0.0, 0.0, lightness);
  float hue = high == c.r ? (c.g - c.b) / range
    : high == c.g ? 2.0 + (c.b - c.r) / range
    : 4.0 + (c.r - c.g) / range;
  return vec3(fract(hue / 6.0), range / max(1.0 - abs(2.0 * lightness - 1.0), 1e-6), lightness);
}

vec3 rgbOf(vec3 hsl) {
  vec3 base = clamp(abs(mod(6.0 * hsl.x + vec3(0.0, 4.0, 2.0), 6.0) - 3.0) - 1.0, 0.0, 1.0);
  return hsl.z + hsl.y * (base - 0.5) * (1.0 - abs(2.0 * hsl.z - 1.0));
}

// `change`: added hue in turns, factor of the saturation, added lightness.
vec3 toned(vec3 c, vec3 change) {
  vec3 hsl = hslOf(clamp(c, 0.0, 1.0));
  hsl.x = fract(hsl.x + change.x);
  hsl.y = clamp(hsl.y * change.y, 0.0, 1.0);
  hsl.z = clamp(hsl.z + change.z, 0.0, 1.0);
  return rgbOf(hsl);
}
