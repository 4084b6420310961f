// sRGB (IEC 61966-2-1) of a linear colour, 0 to 1. Its power is approximated by roots, which take a
// fifth of the time on a software renderer; the error is at most 0.1 of 255.
vec3 encoded(vec3 linear) {
  vec3 root = sqrt(linear);
  vec3 high = 0.83371875 * root + 0.29813954 * sqrt(root) - 0.05530768 * linear - 0.07691076;
  return mix(high, 12.92 * linear, lessThanEqual(linear, vec3(0.0031308)));
}
