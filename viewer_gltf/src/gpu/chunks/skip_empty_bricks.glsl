// The block of uniform bricks around the ray's point t. Component x is where the ray leaves it,
// slightly beyond the boundary, so that the next lookup is in another brick. Component y is 1 if
// nothing in it is visible. A stored distance of d bricks means that the bricks up to d - 1 around
// are empty. A visible brick is a block by itself. Both `start` and `dir` are in bricks; no
// component of `dir` is 0.
vec2 blockAhead(vec3 start, vec3 dir, vec3 invDir, float t) {
  vec3 brick = floor(start + t * dir);
  ivec3 last = textureSize(uOccupancy, 0) - 1;
  float stored = texelFetch(uOccupancy, clamp(ivec3(brick), ivec3(0), last), 0).r;
  float d = floor(stored * 255.0 + 0.5) - uBrickSlack;
  // the wall of the brick through which the ray entered, and as many bricks along each axis
  vec3 entry = brick + 1.0 - step(0.0, dir);
  vec3 exits = (entry - start) * invDir + max(d, 1.0) * abs(invDir);
  float exit = min(min(exits.x, exits.y), exits.z);
  return vec2(max(exit, t) + 1e-3 * uVoxel, step(1.0, d));
}
