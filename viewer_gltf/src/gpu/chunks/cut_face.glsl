// Unit normal of the face through which a ray enters the drawn part; 0 if the ray begins inside.
// The face belongs to the box around all tiles or to a clip plane. Clipped matter is lit by this
// normal, because the gradient of the values has an arbitrary direction there.
vec3 cutFace(vec3 start) {
  float near = 0.05 * uVoxel;
  if (abs(dot(uClipPlane.xyz, start) - uClipPlane.w) < near) return uClipPlane.xyz;
  vec3 low = step(abs(start - max(uClipLow, uAllLow)), vec3(near));
  vec3 high = step(abs(start - min(uClipHigh, uAllHigh)), vec3(near));
  vec3 face = high - low;
  return face == vec3(0.0) ? face : normalize(face);
}
