// The tile that is drawn as a volume, as planes of the scene with dot(xyz, p) < w inside. The
// surfaces of its neighbours end open at its faces. If no tile is a volume, all numbers are 0.
uniform vec4 uOpen[6];

// The normal, towards the eye, of the face through which the ray from the eye to `p` leaves the
// tile; 0 if it does not.
vec3 openNormal(vec3 eye, vec3 p) {
  vec3 normal = vec3(0.0);
  float enters = 0.0;
  float leaves = 1.001;  // surfaces end exactly in the face
  for (int i = 0; i < 6; i++) {
    float slope = dot(uOpen[i].xyz, p - eye);
    float t = (uOpen[i].w - dot(uOpen[i].xyz, eye)) / slope;
    if (slope < 0.0) enters = max(enters, t);
    if (slope > 0.0 && t < leaves) {
      leaves = t;
      normal = -uOpen[i].xyz;
    }
  }
  return enters < leaves ? normal : vec3(0.0);
}
