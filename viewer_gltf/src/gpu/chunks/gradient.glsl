// Gradient of the summed intensities, central differences one voxel to either side: intensity over
// two voxels, in the box's directions. `p` is a texture coordinate.
vec3 gradientAt(vec3 p, vec3 texPerUm) {
  vec3 h = uVoxel * abs(texPerUm);
  vec3 gradient;
  for (int axis = 0; axis < 3; axis++) {
    vec3 e = vec3(0.0);
    e[axis] = h[axis];
    gradient[axis] = dot(sampleIntensities(p + e) - sampleIntensities(p - e), vec4(1.0));
  }
  return gradient * sign(texPerUm);
}
