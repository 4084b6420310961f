// Sum of the channels' intensities at a texture coordinate, weighted by their shares.
float weightedSum(vec3 p, vec4 shares) {
#ifdef CHANNELS
#if CHANNELS == 1
  return sampleIntensities(p).x * shares.x;
#endif
#endif
  return dot(sampleIntensities(p), shares);
}

// Gradient of the intensities, each channel weighted by its share. It is the difference, over two
// voxels, between mean values at the corners of a cube, in the box's directions. Six samples on the
// axes would follow every terrace of a sharp edge, and have twice the noise. The point `p` is a
// texture coordinate.
vec3 gradientAt(vec3 p, vec3 texPerUm, vec4 shares) {
  vec3 h = uVoxel * abs(texPerUm);
  vec3 gradient = vec3(0.0);
  for (int edge = 0; edge < 4; edge++) {  // the cube's edges along x
    vec2 side = vec2(2 * (edge & 1) - 1, (edge & 2) - 1);
    vec3 middle = p + vec3(0.0, side * h.yz);
    float low = weightedSum(vec3(middle.x - h.x, middle.yz), shares);
    float high = weightedSum(vec3(middle.x + h.x, middle.yz), shares);
    gradient += vec3(high - low, side * (low + high));
  }
  return 0.25 * gradient * sign(texPerUm);
}
