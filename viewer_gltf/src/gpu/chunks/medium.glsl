// Single-scattering albedo (rgb) and extinction per um (a) for intensities, from each channel's
// table, linear between its entries. The extinctions of overlapping channels add up.
vec4 mediumOf(vec4 intensity) {
  vec3 color = vec3(0.0);
  float sum = 0.0;
  for (int c = 0; c < CHANNELS; c++) {
    float at = clamp(intensity[c], 0.0, 1.0) * 255.0;
    int left = min(int(at), 254);
    vec4 a = texelFetch(uMedium, ivec2(left, c), 0);
    vec4 b = texelFetch(uMedium, ivec2(left + 1, c), 0);
    vec4 entry = mix(a, b, at - float(left));
    color += entry.rgb * entry.a;
    sum += entry.a;
  }
  return sum > 0.0 ? vec4(color / sum, sum) : vec4(0.0);
}

vec4 mediumAt(vec3 p) {
  if (isInCorner(p)) return vec4(0.0);
  vec3 at = uTexLow + p * uTexPerUm;
#ifdef TWO_D
  return mediumOf2d(sampleIntensities(at), steepnessOf(stepsAt(at, uVoxel * abs(uTexPerUm))));
#else
  return mediumOf(sampleIntensities(at));
#endif
}
