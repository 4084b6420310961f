// An offset of 0 to 1 for each pixel, which turns bands into fine grain. It is blue noise in tiles,
// shifted by uPhase from frame to frame, so that the grain does not stand still. It is counted from
// the eye's own corner, so that both eyes see the same grain in the same place.
float jitter(vec2 pixel) {
  ivec2 size = textureSize(uNoise, 0);
  float noise = texelFetch(uNoise, ivec2(pixel) % size, 0).r;
  return fract((noise * 255.0 + 0.5) / 256.0 + uPhase);
}
