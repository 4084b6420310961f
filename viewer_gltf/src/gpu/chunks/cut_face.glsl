// Unit normal of the face by which a ray comes into what is drawn: of the box round all tiles, or of a cut;
// 0: it begins within. Matter that is cut through is lit as a face: along it the gradient of the matter has no
// side that faces the eye, so that light by it would be a matter of chance.
vec3 cutFace(vec3 start) {
  float near = 0.05 * uVoxel;
  if (abs(dot(uClipPlane.xyz, start) - uClipPlane.w) < near) return uClipPlane.xyz;
  vec3 low = step(abs(start - max(uClipLow, uAllLow)), vec3(near));
  vec3 high = step(abs(start - min(uClipHigh, uAllHigh)), vec3(near));
  vec3 face = high - low;
  return face == vec3(0.0) ? face : normalize(face);
}
