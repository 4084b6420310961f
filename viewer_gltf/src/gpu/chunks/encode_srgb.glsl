// sRGB (IEC 61966-2-1) of a linear colour.
vec3 encoded(vec3 linear) {
  vec3 high = 1.055 * pow(linear, vec3(1.0 / 2.4)) - 0.055;
  return mix(high, 12.92 * linear, lessThanEqual(linear, vec3(0.0031308)));
}
