// Gradient of the intensities, each channel weighted by its share. It is the difference, over two
// voxels, between mean values at the corners of a cube, in the box's directions. Six samples on the
// axes would follow every terrace of a sharp edge, and have twice the noise. The point `p` is a
// texture coordinate.
vec3 gradientAt(vec3 p, vec3 texPerUm, vec4 shares) {
  vec3 h = uVoxel * abs(texPerUm);
  vec3 gradient = vec3(0.0);
  for (int corner = 0; corner < 8; corner++) {
    vec3 side = 2.0 * vec3(corner & 1, (corner >> 1) & 1, corner >> 2) - 1.0;
    gradient += side * dot(sampleIntensities(p + side * h), shares);
  }
  return 0.25 * gradient * sign(texPerUm);
}
