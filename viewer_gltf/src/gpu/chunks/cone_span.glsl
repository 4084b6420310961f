// The part of a ray's span inside the cone with the cosine uReach, an angle below 90 degrees.
// Inside, f(t) = (axis . q)^2 - cos^2 |q|^2 >= 0 for q = eye + t dir - apex, on the side to which
// the axis points.
vec2 coneSpan(vec2 span, vec3 eye, vec3 dir) {
  vec3 m = eye - uApex;
  float square = uReach * uReach;
  float dg = dot(dir, uAxis);
  float mg = dot(m, uAxis);
  float a = dg * dg - square;
  float b = dg * mg - square * dot(dir, m);
  float c = mg * mg - square * dot(m, m);
  float root = b * b - a * c;
  if (root < 0.0) return a > 0.0 && dg > 0.0 ? span : vec2(1.0, 0.0);
  root = sqrt(root);
  float near = (-b - root) / a;
  float far = (-b + root) / a;
  if (a > 0.0) return dg > 0.0 ? vec2(max(span.x, far), span.y) : vec2(span.x, min(span.y, near));
  // a < 0: far < near. From far to near the ray is inside the cone, or inside its mirror image behind the apex.
  if (mg + 0.5 * (near + far) * dg < 0.0) return vec2(1.0, 0.0);
  return vec2(max(span.x, far), min(span.y, near));
}
