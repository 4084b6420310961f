// Weight of each channel's opacity at a point. The extinction grows with the cube of the disc's
// weight; otherwise a dense volume would be opaque all over the soft rim.
vec4 weights(vec3 p) {
  // The full volume, because the frames of surface and volume are mixed later.
  if (uIsCrossing) return vec4(1.0);
  float w = discWeight(p, uApex, uAxis, uDisc);
  return uPresence * mix(vec4(1.0), vec4(w * w * w), vec4(uInDisc));
}
