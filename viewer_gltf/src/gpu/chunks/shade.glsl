// The room's light, as the surfaces have it; the includer declares it: uKeyLight, uFillLight, uSkyLight
// and uGroundLight are what a white surface sends on that faces each, vLight, vFill and vUp lead there;
// and reached(): how much of the surroundings' and of the lamp's comes to a place in the box.

// Steps of intensity over two voxels: below the first they are the noise of 8 bits and of the
// detector, above the second a boundary of its own; between, light fades in.
const float NOISE_STEP = 0.03;
const float BOUNDARY_STEP = 0.18;
const float FLAT_STEP = 1e-4;  // less than one of 8 bits: no direction at all

// What has no boundary is lit through by its surroundings: as bright in the mean as the surfaces.
const float SCATTERED = 1.2;

vec3 lightOn(vec3 normal, vec2 reaches) {
  vec3 around = mix(uGroundLight, uSkyLight, 0.5 + 0.5 * dot(normal, vUp));
  around += uFillLight * max(dot(normal, vFill), 0.0);
  return reaches.y * uKeyLight * max(dot(normal, vLight), 0.0) + reaches.x * around;
}

// Diffuse light by the gradient (Levoy 1988), and the lamp's own gloss (Blinn 1977, exponent 16). Where
// there is none to give a direction, or only noise, light falls as on what faces the eye.
// `um`: the place in the box.
vec3 shadeBy(vec3 color, vec3 gradient, vec3 dir, vec3 um) {
  float steepness = length(gradient);
  float lit = smoothstep(NOISE_STEP, BOUNDARY_STEP, steepness);
  vec3 normal = -gradient / max(steepness, FLAT_STEP);
  if (dot(normal, dir) > 0.0) normal = -normal;
  vec2 reaches = reached(um, mix(-dir, normal, lit));
  vec3 unlit = SCATTERED * color * lightOn(-dir, reaches);
  if (steepness < FLAT_STEP) return unlit;
  float gloss = max(dot(normal, normalize(vLight - dir)), 0.0);
  gloss *= gloss;
  gloss *= gloss;
  gloss *= gloss;
  gloss *= gloss;
  vec3 facing = color * lightOn(normal, reaches) + reaches.y * uGloss * gloss * uKeyLight;
  return mix(unlit, facing, lit);
}
