// Whether a point lies in the corner in front of the slices, which is empty.
bool isInCorner(vec3 p) {
  for (int i = 0; i < 3; i++) {
    if (dot(uCorner[i].xyz, p) <= uCorner[i].w) return false;
  }
  return true;
}
