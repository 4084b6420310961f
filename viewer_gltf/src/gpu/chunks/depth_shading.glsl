// What reaches a place in the volume's box (um) of the light around it, x, and of the lamp's, y: 0..1, from
// a coarse grid round all volumes. Looked up a cell further out, `outwards`, so that what is lit does not
// hide itself.

// What hides light throws some of it back: then volumes are as bright in the mean as the surfaces.
const float LIFT = 1.1;

vec2 reached(vec3 um, vec3 outwards) {
  if (uDepthShading <= 0.0) return vec2(1.0);
  vec3 p = (uToShading * vec4(um + uShadingCell * outwards, 1.0)).xyz;
  return mix(vec2(1.0), LIFT * texture(uReached, p).rg, uDepthShading);
}
