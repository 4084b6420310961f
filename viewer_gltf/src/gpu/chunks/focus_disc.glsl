// Weight of the volume at a point: 1 within the disc's inner radius, 0 beyond the outer one.
// `disc`: cosines of both radii, seen from `apex` along `axis`.
float discWeight(vec3 p, vec3 apex, vec3 axis, vec2 disc) {
  vec3 ray = p - apex;
  return smoothstep(disc.y, max(disc.x, disc.y + 1e-6), dot(ray, axis) / max(length(ray), 1e-9));
}
