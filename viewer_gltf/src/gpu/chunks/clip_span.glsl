// The part of a ray's span that the clip box and the clip plane leave.
vec2 clipSpan(vec2 span, vec3 eye, vec3 dir, vec3 invDir) {
  vec2 box = intersectBox(eye, invDir, uClipLow, uClipHigh);
  span = vec2(max(span.x, box.x), min(span.y, box.y));
  float slope = dot(uClipPlane.xyz, dir);
  float above = dot(uClipPlane.xyz, eye) - uClipPlane.w;
  if (abs(slope) < 1e-9) return above > 0.0 ? vec2(1.0, 0.0) : span;
  float t = -above / slope;
  return slope > 0.0 ? vec2(span.x, min(span.y, t)) : vec2(max(span.x, t), span.y);
}
