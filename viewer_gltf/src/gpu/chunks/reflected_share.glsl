// Shares of even light from all around that a rough surface reflects towards the eye. Component x is
// a factor to the reflectance at right angles, y is the share that comes in addition. `at` has the
// roughness, from 0.5 on, and the cosine of the angle at which the surface is seen.
// The table dfgLUT of three.js has both, but its look-up takes 6 % of a frame of surfaces in software.
// The polynomial is within 0.011 of the table for y, and within 0.045 for x, which counts by 0.04.
vec2 reflectedShare(vec2 at) {
  float rough = at.x - 0.5;
  float slant = 1.0 - at.y;
  vec2 none = vec2(0.9277, 0.0033) + rough * (vec2(-1.1975, -0.0213) + rough * vec2(-0.103, 0.0231));
  vec2 once = vec2(0.0667, -0.0489) + rough * (vec2(-0.6299, 0.3732) + rough * vec2(2.4194, -0.4283));
  vec2 twice = vec2(-0.8223, 0.1317) + rough * (vec2(4.101, -1.061) + rough * vec2(-6.7219, 1.1738));
  vec2 thrice = vec2(0.6053, 0.0949) + rough * (vec2(-1.7012, 0.1275) + rough * vec2(3.6487, -0.1457));
  return none + slant * (once + slant * (twice + slant * thrice));
}
