// How far a ray may go from texture coordinate `p` before it can meet a visible brick; 0 inside
// one. A distance of d bricks means that the block of bricks up to d - 1 around is empty.
float leapLength(vec3 p, vec3 texDir) {
  vec3 q = p * uTexels / 8.0;  // in bricks
  vec3 brick = floor(q);
  ivec3 last = textureSize(uOccupancy, 0) - 1;
  float stored = texelFetch(uOccupancy, clamp(ivec3(brick), ivec3(0), last), 0).r;
  float d = floor(stored * 255.0 + 0.5);
  d -= uBrickSlack;
  if (d < 1.0) return 0.0;
  vec3 dq = texDir * uTexels / 8.0;  // bricks per unit of the ray
  vec3 wall = mix(brick - (d - 1.0), brick + d, vec3(greaterThan(dq, vec3(0.0))));
  vec3 exits = (wall - q) / (dq + 1e-9 * vec3(equal(dq, vec3(0.0))));
  exits = mix(exits, vec3(1e30), lessThan(abs(dq), vec3(1e-9)));
  // A little beyond the wall, so that the next brick is another one.
  return min(min(exits.x, exits.y), exits.z) + 1e-3 * uVoxel;
}
