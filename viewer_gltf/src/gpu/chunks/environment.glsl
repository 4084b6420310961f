// Light from all around: a map of longitude and latitude, constant within each texel, so that the
// density of sampled directions is exact. rgb: radiance; a: density per steradian. The alias table
// (Walker 1977) chooses a texel in proportion to its light. Row 0 is the top (y = 1); column 0
// begins at -z and continues over +x.
ivec2 environmentTexel(vec3 dir) {
  ivec2 size = textureSize(uEnvironment, 0);
  float u = atan(dir.x, -dir.z) / (2.0 * 3.14159265358979);
  float v = acos(clamp(dir.y, -1.0, 1.0)) / 3.14159265358979;
  return min(ivec2(fract(u) * float(size.x), v * float(size.y)), size - 1);
}

vec4 environmentAt(vec3 dir) {
  return texelFetch(uEnvironment, environmentTexel(dir), 0);
}

// Samples a direction; `light` is the radiance from there and the density.
vec3 sampleEnvironment(out vec4 light) {
  ivec2 size = textureSize(uEnvironment, 0);
  int drawn = min(int(random() * float(size.x * size.y)), size.x * size.y - 1);
  vec2 alias = texelFetch(uAliases, ivec2(drawn % size.x, drawn / size.x), 0).xy;
  if (random() >= alias.x) drawn = int(alias.y);
  ivec2 texel = ivec2(drawn % size.x, drawn / size.x);
  light = texelFetch(uEnvironment, texel, 0);
  // uniform in solid angle, since the cosine of the polar angle is uniform
  vec2 ends = cos((vec2(texel.y, texel.y + 1) / float(size.y)) * 3.14159265358979);
  float height = mix(ends.x, ends.y, random());
  float turn = 2.0 * 3.14159265358979 * (float(texel.x) + random()) / float(size.x);
  float flat_ = sqrt(max(0.0, 1.0 - height * height));
  return vec3(flat_ * sin(turn), height, -flat_ * cos(turn));
}
