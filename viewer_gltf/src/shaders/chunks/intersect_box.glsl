// Where a ray enters and leaves the box from 0 to `size` (slab test, Kay & Kajiya 1986).
vec2 intersectBox(vec3 eye, vec3 invDir, vec3 size) {
  vec3 a = -eye * invDir;
  vec3 b = (size - eye) * invDir;
  vec3 low = min(a, b);
  vec3 high = max(a, b);
  return vec2(max(max(low.x, low.y), low.z), min(min(high.x, high.y), high.z));
}
