// A fixed offset in 0..1 for each pixel, which turns bands into fine grain: interleaved gradient
// noise (Jimenez, Next Generation Post Processing in Call of Duty, SIGGRAPH 2014).
float jitter(vec2 pixel) {
  return fract(52.9829189 * fract(dot(pixel, vec2(0.06711056, 0.00583715))));
}
