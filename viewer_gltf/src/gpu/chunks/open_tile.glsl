// The tile that is drawn as a volume, as planes of the room: within is dot(xyz, p) < w. Its neighbours'
// surfaces end at its faces, open; where no tile is a volume all numbers are 0.
uniform vec4 uOpen[6];

// The normal, towards the eye, of the face by which the ray from the eye to `p` leaves the tile; 0: it does not.
vec3 openNormal(vec3 eye, vec3 p) {
  vec3 normal = vec3(0.0);
  float enters = 0.0;
  float leaves = 1.001;  // surfaces end in the face itself
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
