// Where a ray that is in the corner before the slices at `from` leaves it; else `from`.
float cornerExit(float from, vec3 eye, vec3 dir) {
  vec2 within = vec2(-1e30, 1e30);
  for (int i = 0; i < 3; i++) {
    float slope = dot(uCorner[i].xyz, dir);
    float above = dot(uCorner[i].xyz, eye) - uCorner[i].w;
    if (abs(slope) < 1e-9) within.y = above > 0.0 ? within.y : -1e30;
    else if (slope > 0.0) within.x = max(within.x, -above / slope);
    else within.y = min(within.y, -above / slope);
  }
  return within.x <= from ? max(from, within.y) : from;
}

// The part of a ray's span that the clip box, the clip plane and the corner before the slices leave.
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
