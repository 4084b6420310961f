// Diffuse light by the gradient of the summed intensities (Levoy 1988), central differences one
// voxel to either side. 1 where there is no gradient to tell a direction, or only noise.
float shade(vec3 p, vec3 texPerUm, vec3 dir) {
  vec3 h = uVoxel * abs(texPerUm);
  vec3 gradient;
  for (int axis = 0; axis < 3; axis++) {
    vec3 e = vec3(0.0);
    e[axis] = h[axis];
    gradient[axis] = dot(sampleIntensities(p + e) - sampleIntensities(p - e), vec4(1.0));
  }
  gradient *= sign(texPerUm);
  float steepness = length(gradient);
  if (steepness < 1e-4) return 1.0;
  vec3 normal = -gradient / steepness;
  if (dot(normal, dir) > 0.0) normal = -normal;
  float lit = 0.4 + 0.7 * max(dot(normal, vLight), 0.0);
  return mix(1.0, lit, smoothstep(0.03, 0.18, steepness));
}
