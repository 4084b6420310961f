// A fixed offset in 0..1 for each pixel, which turns bands into fine grain: blue noise, in tiles.
// Counted from the eye's own corner, so that both eyes see the same grain at the same place.
float jitter(vec2 pixel) {
  ivec2 size = textureSize(uNoise, 0);
  return (texelFetch(uNoise, ivec2(pixel) % size, 0).r * 255.0 + 0.5) / 256.0;
}
