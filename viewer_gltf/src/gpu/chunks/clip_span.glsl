// Where a ray that begins in the corner in front of the slices leaves it; at least `from`.
float cornerExit(float from, vec3 eye, vec3 dir) {
  float exit = 1e30;
  for (int i = 0; i < 3; i++) {
    float slope = dot(uCorner[i].xyz, dir);
    float above = dot(uCorner[i].xyz, eye) - uCorner[i].w;
    exit = min(exit, slope < 0.0 ? -above / slope : above > 0.0 ? 1e30 : 0.0);
  }
  return max(from, exit);
}

// The part of a ray's span that is kept by the clip box, the clip plane and the corner in front of
// the slices.
vec2 clipSpan(vec2 span, vec3 eye, vec3 dir, vec3 invDir) {
  vec2 box = intersectBox(eye, invDir, uClipLow, uClipHigh);
  span = vec2(max(span.x, box.x), min(span.y, box.y));
  span.x = cornerExit(span.x, eye, dir);
  float slope = dot(uClipPlane.xyz, dir);
  float above = dot(uClipPlane.xyz, eye) - uClipPlane.w;
  if (abs(slope) < 1e-9) return above > 0.0 ? vec2(1.0, 0.0) : span;
  float t = -above / slope;
  return slope > 0.0 ? vec2(span.x, min(span.y, t)) : vec2(max(span.x, t), span.y);
}
