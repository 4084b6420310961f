// Two-dimensional transfer functions: value and gradient magnitude (Kniss, Kindlmann & Hansen 2002);
// docs/transfer-functions.md describes the numbers.

uniform vec4 uGradientMax;  // of each channel: the step of intensity over two voxels that is 1 to its table

// How the intensities change over two voxels, along the axes of the texture.
struct Steps {
  vec4 x;
  vec4 y;
  vec4 z;
};

// `p` is a texture coordinate, `h` a voxel in texture coordinates.
Steps stepsAt(vec3 p, vec3 h) {
  return Steps(
    sampleIntensities(p + vec3(h.x, 0.0, 0.0)) - sampleIntensities(p - vec3(h.x, 0.0, 0.0)),
    sampleIntensities(p + vec3(0.0, h.y, 0.0)) - sampleIntensities(p - vec3(0.0, h.y, 0.0)),
    sampleIntensities(p + vec3(0.0, 0.0, h.z)) - sampleIntensities(p - vec3(0.0, 0.0, h.z)));
}

// Of each channel, 0..1 of what is 1 to its shapes.
vec4 steepnessOf(Steps s) {
  return min(sqrt(s.x * s.x + s.y * s.y + s.z * s.z) / uGradientMax, 1.0);
}
