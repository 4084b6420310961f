// Distances along a ray, in lengths of its direction, at which it enters (x) and leaves (y) the box
// from `low` to `high`. It misses the box if x > y (slab test, Kay & Kajiya 1986).
vec2 intersectBox(vec3 eye, vec3 invDir, vec3 low, vec3 high) {
  vec3 a = (low - eye) * invDir;
  vec3 b = (high - eye) * invDir;
  vec3 near = min(a, b);
  vec3 far = max(a, b);
  return vec2(max(max(near.x, near.y), near.z), min(min(far.x, far.y), far.z));
}
