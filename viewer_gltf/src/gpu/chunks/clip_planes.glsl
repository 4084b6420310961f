// The clip box and clip plane as planes of the scene, which remove the points with dot(xyz, p) > w.
// The last three planes bound the corner in front of the slices, which removes the points beyond
// all three.
uniform vec4 uCuts[10];
uniform int uCutCount;

bool isCut(vec3 p) {
  for (int i = 0; i < uCutCount; i++) {
    if (dot(uCuts[i].xyz, p) > uCuts[i].w) return true;
  }
  for (int i = 7; i < 10; i++) {
    if (dot(uCuts[i].xyz, p) <= uCuts[i].w) return false;
  }
  return true;
}

// The normal of the clip plane through which the ray from the eye to `p` entered; 0 if there is
// none.
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
