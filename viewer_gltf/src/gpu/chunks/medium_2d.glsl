// Like `mediumOf`, by tables of intensity and steepness, 64 rows for each channel.
vec4 mediumOf2d(vec4 intensity, vec4 steepness) {
  vec3 color = vec3(0.0);
  float sum = 0.0;
  for (int c = 0; c < CHANNELS; c++) {
    vec2 at = clamp(vec2(intensity[c], steepness[c]), 0.0, 1.0) * vec2(255.0, 63.0);
    ivec2 low = min(ivec2(at), ivec2(254, 62));
    vec2 share = at - vec2(low);
    low.y += 64 * c;
    vec4 below = mix(
      texelFetch(uMedium, low, 0), texelFetch(uMedium, low + ivec2(1, 0), 0), share.x);
    vec4 above = mix(
      texelFetch(uMedium, low + ivec2(0, 1), 0), texelFetch(uMedium, low + 1, 0), share.x);
    vec4 entry = mix(below, above, share.y);
    color += entry.rgb * entry.a;
    sum += entry.a;
  }
  return sum > 0.0 ? vec4(color / sum, sum) : vec4(0.0);
}
