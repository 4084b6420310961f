// Gradient of the intensities, each channel by its share: differences over two voxels of the means of the
// cube's corners, one voxel to every side, in the box's directions. Six samples on the axes follow every
// terrace of a sharp edge, and noise twice as much. `p` is a texture coordinate.
vec3 gradientAt(vec3 p, vec3 texPerUm, vec4 shares) {
  vec3 h = uVoxel * abs(texPerUm);
  vec3 gradient = vec3(0.0);
  for (int corner = 0; corner < 8; corner++) {
    vec3 side = 2.0 * vec3(corner & 1, (corner >> 1) & 1, corner >> 2) - 1.0;
    gradient += side * dot(sampleIntensities(p + side * h), shares);
  }
  return 0.25 * gradient * sign(texPerUm);
}
