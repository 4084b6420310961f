// An object's colour, linear, with that of a stain over it by the stain's intensity, 0..1.
vec3 objectStain(vec3 color, vec3 stain, float intensity) {
  return mix(color, stain, clamp(intensity, 0.0, 1.0));
}
