// Share of light, 0 to 1, that reaches a place in the volume's box (um): x from all around, y from
// the lamp. It is looked up in a coarse grid around all volumes, one cell outwards, so that matter
// does not shade itself.

// Matter that blocks light also scatters some of it, so this factor makes volumes as bright on
// average as surfaces.
const float LIFT = 1.1;

vec2 reached(vec3 um, vec3 outwards) {
#ifdef SHADED
  vec3 p = (uToShading * vec4(um + uShadingCell * outwards, 1.0)).xyz;
  return mix(vec2(1.0), LIFT * textureLod(uReached, p, 0.0).rg, uDepthShading);
#else
  return vec2(1.0);
#endif
}
