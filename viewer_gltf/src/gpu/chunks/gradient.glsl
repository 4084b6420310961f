// Gradient of the intensities, each channel by its share, central differences one voxel to either
// side: intensity over two voxels, in the box's directions. `p` is a texture coordinate.
vec3 gradientAt(vec3 p, vec3 texPerUm, vec4 shares) {
  vec3 h = uVoxel * abs(texPerUm);
  vec3 gradient;
  for (int axis = 0; axis < 3; axis++) {
    vec3 e = vec3(0.0);
    e[axis] = h[axis];
    gradient[axis] = dot(sampleIntensities(p + e) - sampleIntensities(p - e), shares);
  }
  return gradient * sign(texPerUm);
}
