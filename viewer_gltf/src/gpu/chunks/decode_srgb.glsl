// The linear colour of an sRGB colour (IEC 61966-2-1).
vec3 decoded(vec3 srgb) {
  vec3 high = pow((srgb + 0.055) / 1.055, vec3(2.4));
  return mix(high, srgb / 12.92, lessThanEqual(srgb, vec3(0.04045)));
}
