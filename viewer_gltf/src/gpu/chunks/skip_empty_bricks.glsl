// A ray in units of bricks, with all that stays the same along it: a software renderer would compute
// it again for each look-up. `walls` is, for each axis, t at the entry wall of brick 0.
struct BrickRay {
  vec3 start;
  vec3 dir;
  vec3 invDir;
  vec3 walls;
  vec3 last;  // the last brick along each axis
};

BrickRay brickRay(vec3 start, vec3 dir) {
  dir += 1e-9 * vec3(equal(dir, vec3(0.0)));
  vec3 invDir = 1.0 / dir;
  vec3 walls = (1.0 - step(0.0, dir) - start) * invDir;
  return BrickRay(start, dir, invDir, walls, vec3(textureSize(uOccupancy, 0) - 1));
}

// The block of uniform bricks around the ray's point t. Component x is where the ray leaves it,
// slightly beyond the boundary, so that the next lookup is in another brick. Component y is 1 if
// nothing in it is visible. A stored distance of d bricks means that the bricks up to d - 1 around
// are empty. A visible brick is a block by itself.
vec2 blockAhead(BrickRay ray, float t) {
  vec3 brick = floor(ray.start + t * ray.dir);
  float stored = texelFetch(uOccupancy, ivec3(clamp(brick, vec3(0.0), ray.last)), 0).r;
  float d = stored * 255.0 - uBrickSlack;
  // the wall of the brick through which the ray entered, and as many bricks along each axis
  vec3 exits = brick * ray.invDir + ray.walls + max(d, 1.0) * abs(ray.invDir);
  float exit = min(min(exits.x, exits.y), exits.z);
  return vec2(max(exit, t) + 1e-3 * uVoxel, step(0.5, d));
}
