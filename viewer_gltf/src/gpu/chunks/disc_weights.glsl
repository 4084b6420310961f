// By how much each channel's opacity counts at a point: extinction grows with the cube of the
// disc's weight, as a dense volume would else be opaque all over the feather.
vec4 weights(vec3 p) {
  if (uIsCrossing) return vec4(1.0);  // whole: the pictures of surface and volume are mixed
  float w = discWeight(p, uApex, uAxis, uDisc);
  return uPresence * mix(vec4(1.0), vec4(w * w * w), vec4(uInDisc));
}
