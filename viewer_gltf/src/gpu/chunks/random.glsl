// Random numbers, 24 bits each: PCG (O'Neill 2014), seeded by pcg3d of Jarzynski & Olano, JCGT 2020.
uint randomState;

void seedRandom(uvec3 at) {
  at = at * 1664525u + 1013904223u;
  at += at.yzx * at.zxy;
  at ^= at >> 16u;
  at += at.yzx * at.zxy;
  randomState = at.x ^ (at.y * 2654435769u) ^ at.z;
}

// Uniform in [0, 1).
float random() {
  randomState = randomState * 747796405u + 2891336453u;
  uint word = ((randomState >> ((randomState >> 28u) + 4u)) ^ randomState) * 277803737u;
  word = (word >> 22u) ^ word;
  return float(word >> 8u) / 16777216.0;
}
