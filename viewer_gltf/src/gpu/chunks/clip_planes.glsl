// What the clip box and plane cut away, as planes of the room: gone is where dot(xyz, p) > w; and the
// corner before the slices, which the last three bound: gone is what lies beyond all of them.
uniform vec4 uCuts[10];
uniform int uCutCount;

bool isInCorner(vec3 p) {
  for (int i = 7; i < 10; i++) {
    if (dot(uCuts[i].xyz, p) <= uCuts[i].w) return false;
  }
  return true;
}

bool isCut(vec3 p) {
  if (isInCorner(p)) return true;
  for (int i = 0; i < uCutCount; i++) {
    if (dot(uCuts[i].xyz, p) > uCuts[i].w) return true;
  }
  return false;
}

// The normal of the cut by which the ray from the eye to `p` came in; 0 if it met none.
vec3 cutNormal(vec3 eye, vec3 p) {
  vec3 normal = vec3(0.0);
  float latest = 0.0;
  for (int i = 0; i < uCutCount; i++) {
    float above = dot(uCuts[i].xyz, eye) - uCuts[i].w;
    float slope = dot(uCuts[i].xyz, eye - p);
    if (above <= 0.0 || slope <= 0.0) continue;  // the eye is on the kept side
    float t = above / slope;
    if (t > latest) {
      latest = t;
      normal = uCuts[i].xyz;
    }
  }
  return normal;
}
