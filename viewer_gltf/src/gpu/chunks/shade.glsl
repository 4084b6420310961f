const float AMBIENT = 0.4;  // for sides that face away: they keep the channel's colour
const float DIFFUSE = 0.7;  // a little above 1 in all, as the surfaces' lamp is
// Steps of intensity over two voxels: below the first they are the noise of 8 bits and of the
// detector, above the second a boundary of its own; between, light fades in.
const float NOISE_STEP = 0.03;
const float BOUNDARY_STEP = 0.18;
const float FLAT_STEP = 1e-4;  // less than one of 8 bits: no direction at all

// Diffuse light by the gradient (Levoy 1988). 1 where there is none to give a direction, or only
// noise.
float shadeBy(vec3 gradient, vec3 dir) {
  float steepness = length(gradient);
  if (steepness < FLAT_STEP) return 1.0;
  vec3 normal = -gradient / steepness;
  if (dot(normal, dir) > 0.0) normal = -normal;
  float lit = AMBIENT + DIFFUSE * max(dot(normal, vLight), 0.0);
  return mix(1.0, lit, smoothstep(NOISE_STEP, BOUNDARY_STEP, steepness));
}

float shade(vec3 p, vec3 texPerUm, vec3 dir) {
  return shadeBy(gradientAt(p, texPerUm), dir);
}
