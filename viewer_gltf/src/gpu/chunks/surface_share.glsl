// How much of a surface is left where its volume takes its place. It needs focus_disc.glsl before it.
uniform vec2 uDisc;
uniform vec3 uApex;
uniform vec3 uAxis;
uniform float uOpacity;
uniform float uTaken;  // what the volume takes, 0..1: in the disc, or everywhere
uniform bool uInDisc;
uniform bool uCrosses;  // whether the volume's picture is mixed with the surface's in the disc

// Returns the share of the surface that the volume takes at a place of the scene, 0..1.
float shareTaken(vec3 p) {
  return uTaken * (uInDisc ? discWeight(p, uApex, uAxis, uDisc) : 1.0);
}

// Whether nothing is left. A surface that is mixed with its volume's picture is drawn also where that has taken all.
bool isGone(vec3 p) {
  return uOpacity <= 0.0 || (!uCrosses && shareTaken(p) >= 1.0);
}
