// The scene's light, the same as for surfaces. The including shader declares three things. The
// light that a white surface reflects when it faces each lamp: uKeyLight, uFillLight, uSkyLight,
// uGroundLight. The directions to the lamps and the sky: vLight, vFill, vUp. The function
// reached(): the shares of the surrounding light and of the key light that reach a place in the
// box.

// Steps of intensity over two voxels. Steps below the first are noise of 8 bits and of the
// detector; above the second they are boundaries. In between, shading fades in.
const float NOISE_STEP = 0.03;
const float BOUNDARY_STEP = 0.18;
const float FLAT_STEP = 1e-4;  // less than one step of 8 bits: no direction at all

// Matter without a boundary is lit from all around by this factor: on average as bright as the
// surfaces.
const float SCATTERED = 1.2;

vec3 lightAround(vec3 normal) {
  vec3 around = mix(uGroundLight, uSkyLight, 0.5 + 0.5 * dot(normal, vUp));
  return around + uFillLight * max(dot(normal, vFill), 0.0);
}

// The light of a ray's samples, as far as it is the same for all of them. A software renderer would
// compute it again for each sample.
struct RayLight {
  vec3 dir;
  vec3 halfway;  // between the directions to the lamp and to the eye
  vec3 key;  // light of the lamp on matter without a boundary, as if it faced the eye
  vec3 around;  // all other light on such matter
};

RayLight lightAlong(vec3 dir) {
  vec3 key = SCATTERED * uKeyLight * max(dot(-dir, vLight), 0.0);
  vec3 between = vLight - dir;  // zero where the ray runs straight to the lamp
  vec3 halfway = between / max(length(between), 1e-6);
  return RayLight(dir, halfway, key, SCATTERED * lightAround(-dir));
}

// Diffuse light by the gradient (Levoy 1988), and a highlight of the key light (Blinn 1977,
// exponent 16). Where the gradient is zero or only noise, matter is lit as if it faced the eye.
// `um`: the place in the box.
vec3 shadeBy(vec3 color, vec3 gradient, RayLight ray, vec3 um) {
  float steepness = length(gradient);
  float lit = smoothstep(NOISE_STEP, BOUNDARY_STEP, steepness);
  vec3 normal = -gradient / max(steepness, FLAT_STEP);
  if (dot(normal, ray.dir) > 0.0) normal = -normal;
  vec2 reaches = reached(um, mix(-ray.dir, normal, lit));
  vec3 unlit = color * (reaches.y * ray.key + reaches.x * ray.around);
  float gloss = max(dot(normal, ray.halfway), 0.0);
  gloss *= gloss;
  gloss *= gloss;
  gloss *= gloss;
  gloss *= gloss;
  vec3 key = reaches.y * uKeyLight;
  vec3 diffuse = key * max(dot(normal, vLight), 0.0) + reaches.x * lightAround(normal);
  return mix(unlit, color * diffuse + uGloss * gloss * key, lit);
}
