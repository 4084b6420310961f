// For an eye that looks through a lens, the periphery is marched in fewer steps. Farther out, only
// every second block of 2 x 2 pixels is marched, because the GPU shades a block together: radial
// density masking (Vlachos, Advanced VR Rendering Performance, GDC 2016).
uniform vec4 uLens;  // tangents from the eye's axis for clip space: factor, offset; 0: no lens

// Tangents between which steps fall by half: 20 and 45 degrees.
const vec2 SPARSE = vec2(0.36, 1.0);
const float MASKED = 0.47;  // tangent from which blocks are skipped: 25 degrees

// `part`: the eye's part of the image: x, y, width, height, pixels.
float tangentAt(vec2 pixel, vec4 part) {
  vec2 clip = 2.0 * (pixel - part.xy) / part.zw - 1.0;
  return length(clip * uLens.xy + uLens.zw);
}

float shareOfSteps(vec2 pixel, vec4 part) {
  if (uLens.x <= 0.0) return 1.0;
  return 1.0 - 0.5 * smoothstep(SPARSE.x, SPARSE.y, tangentAt(pixel, part));
}

bool isSparse(ivec2 pixel, vec4 part) {
  return uLens.x > 0.0 && tangentAt(vec2(2 * (pixel >> 1) + 1), part) > MASKED;
}

bool isLeftOut(ivec2 pixel, vec4 part) {
  ivec2 block = pixel >> 1;
  return ((block.x + block.y) & 1) == 1 && isSparse(pixel, part);
}
