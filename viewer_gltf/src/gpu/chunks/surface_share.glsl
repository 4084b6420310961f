// The share of a surface that is left where its volume replaces it. It needs focus_disc.glsl before
// it.
uniform vec2 uDisc;
uniform vec3 uApex;
uniform vec3 uAxis;
uniform float uOpacity;
uniform float uTaken;  // share that the volume replaces, 0 to 1: in the disc, or everywhere
uniform bool uInDisc;
uniform bool uCrosses;  // whether the images of volume and surface are mixed in the disc

// Returns the share of the surface that the volume replaces at a place of the scene, 0 to 1.
float shareTaken(vec3 p) {
  return uTaken * (uInDisc ? discWeight(p, uApex, uAxis, uDisc) : 1.0);
}

// Whether nothing of the surface is left. A surface that is mixed with its volume's image is drawn
// even where the volume has replaced all of it.
bool isGone(vec3 p) {
  return uOpacity <= 0.0 || (!uCrosses && shareTaken(p) >= 1.0);
}
