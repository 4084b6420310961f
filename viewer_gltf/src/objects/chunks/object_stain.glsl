// Mixes the colour of a stain into an object's colour by the stain's intensity, 0..1. Both colours are linear.
vec3 objectStain(vec3 color, vec3 stain, float intensity) {
  return mix(color, stain, clamp(intensity, 0.0, 1.0));
}
